//! From the options to a validated plan.

use std::path::PathBuf;

use super::args::GeodesicConfig;
use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::options::{Align, resolve_law};
use crate::shapes::{Components, Placed, VisibilityMask, read_view};
use shapespace_input::dimension::{Dim, per_dimension};
use shapespace_input::{Image, Sources};

/// Inputs that are read, placed and validated, and the parameters of the computation.
pub(crate) struct GeodesicPlan<const D: usize> {
    /// The masks in the unit box: start and end.
    pub placed: Placed<D>,
    /// Their components, if there are several.
    pub parts: Option<Components<D>>,
    /// Visibility masks of start and end, if any.
    pub views: [Option<VisibilityMask<D>>; 2],
    /// The inputs and parameters that the path depends on.
    pub fingerprint: Fingerprint,
    /// The configuration with all defaults resolved.
    pub config: GeodesicConfig,
}

/// Reads, places and validates the inputs of a geodesic.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub(super) fn plan_geodesic(
    config: GeodesicConfig,
    sources: &Sources,
) -> Result<Dim<GeodesicPlan<2>, GeodesicPlan<3>>, CliError> {
    let ends = [config.start.clone(), config.end.clone()];
    let images = if config.labels {
        sources.read_label_images(&ends)?
    } else {
        sources.read_images(&ends, &config.masks.reading())?
    };
    Ok(per_dimension!(images, images => plan_images(images, sources, config)?))
}

fn plan_images<const D: usize>(
    images: Vec<Image<D>>,
    sources: &Sources,
    mut config: GeodesicConfig,
) -> Result<GeodesicPlan<D>, CliError> {
    let mut inputs: Vec<String> = images.iter().map(hash).collect();
    let (images, parts) = if config.labels {
        let (images, parts) = Components::split(&images)?;
        (images, Some(parts))
    } else {
        (images, None)
    };
    resolve_law::<D>(&mut config.params.law)?;
    // Hidden parts would distort an alignment of the whole shapes.
    let align = config.occluded.is_some().then_some(Align::None);
    let view = |path: &mut Option<PathBuf>, image: &Image<D>, option| {
        let view = path
            .as_deref()
            .map(|path| read_view(path, image, sources, option));
        let view = view.transpose()?.flatten();
        if view.is_none() {
            // A mask that hides nothing is as none.
            *path = None;
        }
        Ok::<_, CliError>(view)
    };
    let views = [
        view(&mut config.valid_start, &images[0], "--valid-start")?,
        view(&mut config.valid_end, &images[1], "--valid-end")?,
    ];
    let mut placed = Placed::by_default(images, &mut config.masks, align)?;
    let ends = [config.start.clone(), config.end.clone()];
    placed.lead(&ends, config.like.as_deref())?;
    // A place for each of both, so that one of the start is not taken for one of the end.
    inputs.extend(views.iter().map(|view| match view {
        Some(mask) => hash(&mask.image),
        None => "none".into(),
    }));
    let mut fingerprint = Fingerprint::new(&config, inputs);
    for name in ["start", "end", "valid_start", "valid_end"] {
        fingerprint.leave_out(name);
    }
    Ok(GeodesicPlan {
        placed,
        parts,
        views,
        fingerprint,
        config,
    })
}
