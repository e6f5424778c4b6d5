//! Scaling of masks to objects of equal size.

use levelset::Moments;

use shapespace_input::{Image, LEVEL};

/// Scales the spacings of images so that all objects have the mean extent, which is the root of
/// area or volume. Returns the factors.
pub(super) fn equalise<const D: usize>(images: &mut [Image<D>]) -> Vec<f64> {
    let extent = |image: &Image<D>| {
        let exact = image.outline.as_ref().map(Moments::of_contour);
        let samples = match exact {
            Some(Ok(exact)) => exact.volume,
            _ => image.values.iter().filter(|v| *v > LEVEL).count() as f64,
        };
        let volume = samples * image.sample_volume();
        volume.powf(1.0 / D as f64)
    };
    let extents: Vec<f64> = images.iter().map(extent).collect();
    // Added by size, so that the order of the inputs does not change a bit of the sum.
    let mut sorted = extents.clone();
    sorted.sort_by(f64::total_cmp);
    let mean = sorted.iter().sum::<f64>() / extents.len().max(1) as f64;
    let factors: Vec<f64> = extents.iter().map(|extent| mean / extent).collect();
    for (image, &factor) in images.iter_mut().zip(&factors) {
        image.spacing = image.spacing.map(|h| factor * h);
        image.origin = image.origin.map(|x| factor * x);
        // The values are no nodal values any more, and the world coordinates of the file do not
        // apply.
        image.plain_array = false;
        image.affine = None;
    }
    factors
}

#[cfg(test)]
mod tests {
    use super::*;
    use shapespace_input::block;
    use shapespace_input::place::fit_frames;

    #[test]
    fn equal_sizes_are_equal_in_the_box() {
        let mut images = [
            block([40, 40], [1.0; 2], [5, 5], [14, 14]),
            block([80, 30], [0.5, 2.0], [10, 10], [69, 14]),
        ];
        images[0].plain_array = true;
        let factors = equalise(&mut images);
        assert!((factors[0] / factors[1] - (3.0f64).sqrt()).abs() < 1e-12);
        let frames = fit_frames(&images, None);
        let areas = images.iter().zip(frames).map(|(image, frame)| {
            let samples = image.values.iter().filter(|v| *v > LEVEL).count() as f64;
            samples * frame.sample_size().iter().product::<f64>()
        });
        let areas: Vec<f64> = areas.collect();
        assert!((areas[0] / areas[1] - 1.0).abs() < 1e-12, "{areas:?}");
        assert!(!images[0].plain_array);
    }

    #[test]
    fn the_order_changes_no_bit() {
        // The sum of these has another last bit in another order.
        let image = |h: f64| block([20, 20], [h; 2], [5, 5], [14, 14]);
        let sizes = [0.11, 0.23, 0.37, 0.71];
        let factors = |order: [usize; 4]| {
            let mut images = order.map(|k| image(sizes[k]));
            let found = equalise(&mut images);
            (0..4)
                .map(|k| found[order.iter().position(|o| *o == k).unwrap()])
                .collect::<Vec<_>>()
        };
        let first = factors([0, 1, 2, 3]);
        for order in [[3, 2, 1, 0], [1, 3, 0, 2], [2, 0, 3, 1], [0, 3, 1, 2]] {
            assert_eq!(factors(order), first);
        }
    }
}
