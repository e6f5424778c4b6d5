//! From a configuration to a validated plan.

use std::path::Path;

use super::args::AverageConfig;
use super::views;
use crate::error::CliError;
use crate::input::{AnyImages, Image, ReadOptions, read_images};
use crate::options::check_law;
use crate::output::ResultDir;
use crate::shapes::{Placed, VisibilityMask};

/// Inputs that are read, placed and validated, and the parameters of the computation.
#[derive(Clone, Debug)]
pub struct AveragePlan<const D: usize> {
    /// The masks in the unit box.
    pub(crate) placed: Placed<D>,
    /// Visibility masks of the shapes.
    pub(super) views: Vec<Option<VisibilityMask<D>>>,
    /// The configuration with all defaults resolved.
    pub config: AverageConfig,
}

/// A plan of either dimension.
#[derive(Clone, Debug)]
pub enum AnyPlan {
    /// In 2D.
    D2(AveragePlan<2>),
    /// In 3D.
    D3(AveragePlan<3>),
}

/// Reads and places the inputs of an average.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub fn plan_average(config: AverageConfig, output: &Path) -> Result<AnyPlan, CliError> {
    ResultDir::check(output)?;
    let options = ReadOptions {
        label: config.masks.label,
    };
    match read_images(&config.inputs, &options)? {
        AnyImages::D2(images) => {
            let views = views::read(&config.valid, |images| match images {
                AnyImages::D2(images) => Some(images),
                AnyImages::D3(_) => None,
            })?;
            plan_images(images, views, config).map(AnyPlan::D2)
        }
        AnyImages::D3(images) => {
            let views = views::read(&config.valid, |images| match images {
                AnyImages::D2(_) => None,
                AnyImages::D3(images) => Some(images),
            })?;
            plan_images(images, views, config).map(AnyPlan::D3)
        }
    }
}

/// Places images, and completes the configuration.
///
/// # Errors
/// As [`plan_average`].
pub(super) fn plan_images<const D: usize>(
    images: Vec<Image<D>>,
    views: Vec<Option<VisibilityMask<D>>>,
    mut config: AverageConfig,
) -> Result<AveragePlan<D>, CliError> {
    check_law::<D>(&config.params.law)?;
    let placed = Placed::new(images, &mut config.masks)?;
    if config.sweep.is_none() {
        let weights = config.weights()?;
        config.params.weights.get_or_insert(weights);
    }
    config.params.length_weight = Some(config.params.resolved_length_weight());
    Ok(AveragePlan {
        placed,
        views,
        config,
    })
}
