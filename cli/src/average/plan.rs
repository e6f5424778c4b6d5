//! From a configuration to a validated plan.

use super::args::AverageConfig;
use super::views;
use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::options::resolve_law;
use crate::progress::Progress;
use crate::shapes::{Components, Placed, VisibilityMask};
use shapespace_input::dimension::{Dim, per_dimension};
use shapespace_input::{Image, Sources};

/// Inputs that are read, placed and validated, and the parameters of the computation.
pub(crate) struct AveragePlan<const D: usize> {
    /// The masks in the unit box.
    pub(super) placed: Placed<D>,
    /// The components of the masks, if there are several.
    pub(super) parts: Option<Components<D>>,
    /// Visibility masks of the shapes.
    pub(super) views: Vec<Option<VisibilityMask<D>>>,
    /// The configuration with all defaults resolved.
    pub(super) config: AverageConfig,
}

/// Reads and places the inputs of an average.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub(super) fn plan_average(
    config: AverageConfig,
    sources: &Sources,
    progress: &Progress,
) -> Result<Dim<AveragePlan<2>, AveragePlan<3>>, CliError> {
    progress.stage(format!("reading {} masks", config.inputs.len()));
    let images = if config.labels {
        sources.read_label_images(&config.inputs)?
    } else {
        sources.read_images(&config.inputs, &config.masks.reading())?
    };
    Ok(per_dimension!(images, images => {
        let views = views::read(&config.valid, &images, sources)?;
        plan_images(images, views, config)?
    }))
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
    resolve_law::<D>(&mut config.params.law)?;
    if views.is_empty() {
        // Masks that hide nothing are as none.
        config.valid.clear();
    }
    let (images, parts) = if config.labels {
        let (whole, parts) = Components::each(&images)?;
        (whole, Some(parts).filter(|parts| parts.labels.len() > 1))
    } else {
        (images, None)
    };
    let mut placed = Placed::new(images, &mut config.masks)?;
    placed.lead(&config.inputs, config.like.as_deref())?;
    if config.sweep.is_none() {
        let weights = config.weights()?;
        config.params.weights.get_or_insert(weights);
    }
    config.params.length_weight = Some(config.params.resolved_length_weight());
    Ok(AveragePlan {
        placed,
        parts,
        views,
        config,
    })
}

/// The inputs and parameters that the deformations depend on.
pub(super) fn fingerprint<const D: usize>(
    config: &AverageConfig,
    images: &[Image<D>],
    parts: Option<&Components<D>>,
    views: &[Option<VisibilityMask<D>>],
) -> Fingerprint {
    let parts = parts.into_iter().flat_map(Components::masks).map(hash);
    let views = views.iter().flatten().map(|mask| hash(&mask.image));
    let images = images.iter().map(hash);
    Fingerprint::new(config, images.chain(parts).chain(views).collect())
}
