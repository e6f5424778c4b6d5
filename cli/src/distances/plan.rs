//! From the options to a validated plan.

use super::args::DistancesConfig;
use super::classes::Labels;
use crate::error::CliError;
use crate::options::{Align, MaskOptions, resolve_law};
use crate::shapes::Placed;
use shapespace_input::dimension::{Dim, per_dimension};
use shapespace_input::{Image, Sources};

/// Inputs that are read, placed and validated, and the parameters of the computation.
pub(crate) struct DistancesPlan<const D: usize> {
    /// The masks in the unit box.
    pub placed: Placed<D>,
    pub(super) labels: Option<Labels>,
    /// The configuration with all defaults resolved except the number of clusters.
    pub config: DistancesConfig,
}

/// Reads, places and validates the inputs of distances.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub(super) fn plan_distances(
    config: DistancesConfig,
    sources: &Sources,
) -> Result<Dim<DistancesPlan<2>, DistancesPlan<3>>, CliError> {
    let images = sources.read_images(&config.shapes(), &config.masks.reading())?;
    Ok(per_dimension!(images, images => plan_images(images, config)?))
}

fn plan_images<const D: usize>(
    images: Vec<Image<D>>,
    mut config: DistancesConfig,
) -> Result<DistancesPlan<D>, CliError> {
    resolve_law::<D>(&mut config.params.law)?;
    let mut masks = MaskOptions {
        align: config.masks.align.or(Some(Align::None)),
        ..config.masks
    };
    let mut placed = Placed::new(images, &mut masks)?;
    // Pairs are aligned individually, not all shapes with one.
    placed.align = Align::None;
    config.masks = MaskOptions {
        align: config.masks.align,
        ..masks
    };
    let classes = config.classes.as_deref();
    Ok(DistancesPlan {
        placed,
        labels: classes
            .map(|option| Labels::of(option, &config))
            .transpose()?,
        config,
    })
}
