//! From the options to a validated plan.

use super::args::DistancesConfig;
use super::classes::Classes;
use crate::dimension::{Dim, per_dimension};
use crate::error::CliError;
use crate::input::{Image, LEVEL, read_images};
use crate::options::{Align, MaskOptions, Size, check_law};
use crate::shapes::Placed;

/// Inputs that are read, placed and validated, and the parameters of the computation.
pub(super) struct DistancesPlan<const D: usize> {
    /// The masks in the unit box.
    pub placed: Placed<D>,
    pub classes: Option<Classes>,
    /// The configuration with all defaults resolved except the number of clusters.
    pub config: DistancesConfig,
}

/// Reads, places and validates the inputs of distances.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub(super) fn plan_distances(
    config: DistancesConfig,
) -> Result<Dim<DistancesPlan<2>, DistancesPlan<3>>, CliError> {
    let images = read_images(&config.inputs, &config.masks.reading())?;
    Ok(per_dimension!(images, images => plan_images(images, config)?))
}

fn plan_images<const D: usize>(
    mut images: Vec<Image<D>>,
    mut config: DistancesConfig,
) -> Result<DistancesPlan<D>, CliError> {
    check_law::<D>(&config.params.law)?;
    if config.size == Size::Equal {
        equalise(&mut images);
    }
    // Pairs are aligned individually, not all shapes with one.
    let mut masks = MaskOptions {
        align: Align::None,
        ..config.masks
    };
    let placed = Placed::new(images, &mut masks)?;
    config.masks.grid = masks.grid;
    let classes = config.classes.as_deref();
    Ok(DistancesPlan {
        placed,
        classes: classes
            .map(|option| Classes::of(option, &config.inputs))
            .transpose()?,
        config,
    })
}

/// Scales the spacings of images so that all objects have the mean extent, which is the root of
/// area or volume.
fn equalise<const D: usize>(images: &mut [Image<D>]) {
    let extent = |image: &Image<D>| {
        let samples = image.values.iter().filter(|v| **v > LEVEL).count() as f64;
        let volume = samples * image.spacing.iter().product::<f64>();
        volume.powf(1.0 / D as f64)
    };
    let extents: Vec<f64> = images.iter().map(extent).collect();
    let mean = extents.iter().sum::<f64>() / extents.len().max(1) as f64;
    for (image, extent) in images.iter_mut().zip(extents) {
        let factor = mean / extent;
        image.spacing = image.spacing.map(|h| factor * h);
        image.origin = image.origin.map(|x| factor * x);
        // The values are no nodal values any more, and the world coordinates of the file do not
        // apply.
        image.plain_array = false;
        image.affine = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::place::{fit_frames, tests::block};

    #[test]
    fn equal_sizes_are_equal_in_the_box() {
        let mut images = [
            block([40, 40], [1.0; 2], [5, 5], [14, 14]),
            block([80, 30], [0.5, 2.0], [10, 10], [69, 14]),
        ];
        images[0].plain_array = true;
        equalise(&mut images);
        let frames = fit_frames(&images, 40);
        let areas = images.iter().zip(frames).map(|(image, frame)| {
            let samples = image.values.iter().filter(|v| **v > LEVEL).count() as f64;
            samples * frame.sample_size().iter().product::<f64>()
        });
        let areas: Vec<f64> = areas.collect();
        assert!((areas[0] / areas[1] - 1.0).abs() < 1e-12, "{areas:?}");
        assert!(!images[0].plain_array);
    }
}
