//! From the options to a validated plan.

use std::path::Path;

use super::args::GeodesicConfig;
use crate::error::CliError;
use crate::input::{AnyImages, Image, ReadOptions, read_images, read_label_images};
use crate::options::check_law;
use crate::output::ResultDir;
use crate::shapes::{Components, Placed, VisibilityMask};

/// Inputs that are read, placed and validated, and the parameters of the computation.
#[derive(Clone, Debug)]
pub struct GeodesicPlan<const D: usize> {
    /// The masks in the unit box: start and end.
    pub(crate) placed: Placed<D>,
    /// Their components, if there are several.
    pub(crate) parts: Option<Components<D>>,
    /// Visibility masks of start and end, if given.
    pub(crate) views: [Option<VisibilityMask<D>>; 2],
    /// The configuration with all defaults resolved.
    pub config: GeodesicConfig,
}

/// A plan of either dimension.
#[derive(Clone, Debug)]
pub enum AnyPlan {
    /// In 2D.
    D2(GeodesicPlan<2>),
    /// In 3D.
    D3(GeodesicPlan<3>),
}

/// Reads, places and validates the inputs of a geodesic.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub fn plan_geodesic(config: GeodesicConfig, output: &Path) -> Result<AnyPlan, CliError> {
    ResultDir::check(output)?;
    let options = ReadOptions {
        label: config.masks.label,
    };
    let ends = [config.start.clone(), config.end.clone()];
    let images = if config.labels {
        read_label_images(&ends)?
    } else {
        read_images(&ends, &options)?
    };
    let views = [&config.valid_start, &config.valid_end].map(|path| {
        path.as_ref()
            .map(|path| read_images(std::slice::from_ref(path), &ReadOptions::default()))
            .transpose()
    });
    let [first, second] = views;
    let views = [first?, second?];
    match images {
        AnyImages::D2(images) => {
            let views = views.map(|view| match view {
                Some(AnyImages::D2(mut images)) => Ok(images.pop()),
                None => Ok(None),
                Some(AnyImages::D3(images)) => Err(other_dimension(&images)),
            });
            let [first, second] = views;
            plan_images(images, [first?, second?], config).map(AnyPlan::D2)
        }
        AnyImages::D3(images) => {
            let views = views.map(|view| match view {
                Some(AnyImages::D3(mut images)) => Ok(images.pop()),
                None => Ok(None),
                Some(AnyImages::D2(images)) => Err(other_dimension(&images)),
            });
            let [first, second] = views;
            plan_images(images, [first?, second?], config).map(AnyPlan::D3)
        }
    }
}

/// A visibility mask has the dimension of its shape.
fn other_dimension<const D: usize>(images: &[Image<D>]) -> CliError {
    CliError::Option {
        option: "--valid-start or --valid-end",
        value: images
            .first()
            .map(|image| image.path.display().to_string())
            .unwrap_or_default(),
        remedy: "give a mask with as many axes and values as the shape's own image".into(),
    }
}

fn plan_images<const D: usize>(
    images: Vec<Image<D>>,
    views: [Option<Image<D>>; 2],
    mut config: GeodesicConfig,
) -> Result<GeodesicPlan<D>, CliError> {
    let (images, parts) = if config.labels {
        let (images, parts) = Components::split(&images)?;
        (images, Some(parts))
    } else {
        (images, None)
    };
    check_law::<D>(&config.params.law)?;
    let [start, end] = views;
    let seen =
        |image: Option<Image<D>>, option| image.map(|image| VisibilityMask { image, option });
    Ok(GeodesicPlan {
        placed: Placed::new(images, &mut config.masks)?,
        parts,
        views: [seen(start, "--valid-start"), seen(end, "--valid-end")],
        config,
    })
}
