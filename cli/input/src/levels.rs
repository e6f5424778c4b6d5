//! Whether a mask has two levels.

use super::{Image, LEVEL};

/// Values of an object above this are white, and of a background below this black.
const WHITE: f64 = 0.9;
const BLACK: f64 = 0.1;
/// Distance from the boundary, in samples along every axis, up to which grey values are those of a
/// smoothed boundary.
const EDGE: usize = 2;

/// The share of the object's samples that are grey although the object continues two samples
/// further in every direction, or that of the background: none in a mask with smoothed boundaries, most in a grey image.
pub fn grey_share<const D: usize>(image: &Image<D>) -> f64 {
    let share_of = |object: bool, grey: [f64; 2]| {
        let samples = || image.values.iter().enumerate();
        let own = samples().filter(|(_, value)| (*value > LEVEL) == object);
        let grey = samples().filter(|(index, value)| {
            (grey[0]..=grey[1]).contains(value)
                && (*value > LEVEL) == object
                && is_deep(image, image.sample(*index), object)
        });
        grey.count() as f64 / own.count().max(1) as f64
    };
    share_of(true, [LEVEL, WHITE]).max(share_of(false, [BLACK, LEVEL]))
}

/// Whether all samples around one lie in the object, or in the background. What lies beyond the image is unknown.
fn is_deep<const D: usize>(image: &Image<D>, sample: [usize; D], object: bool) -> bool {
    let side = 2 * EDGE + 1;
    (0..side.pow(D as u32)).all(|mut number| {
        let mut near = sample;
        for k in 0..D {
            let Some(i) = (sample[k] + number % side).checked_sub(EDGE) else {
                return true;
            };
            if i >= image.size[k] {
                return true;
            }
            near[k] = i;
            number /= side;
        }
        (image.values.get(image.index(near)) > LEVEL) == object
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block;

    /// A disk of radius 12 whose values fall over this number of samples.
    fn disk(ramp: f64) -> Image<2> {
        let mut image = block([40, 40], [1.0; 2], [0, 0], [0, 0]);
        let value = |index| {
            let [x, y] = image.sample(index).map(|i| i as f64 - 19.6);
            (0.5 + (12.0 - x.hypot(y)) / ramp).clamp(0.0, 1.0)
        };
        let values: Vec<f64> = (0..image.values.len()).map(value).collect();
        image.values = values.into();
        image
    }

    #[test]
    fn masks_and_smoothed_masks_have_no_grey_values() {
        assert_eq!(
            grey_share(&block([20, 20, 20], [1.0; 3], [4; 3], [15; 3])),
            0.0
        );
        for ramp in [1e-9, 1.0, 3.0] {
            assert_eq!(grey_share(&disk(ramp)), 0.0, "{ramp}");
        }
    }

    #[test]
    fn a_scan_is_grey() {
        // A cone: white in the middle only.
        let share = grey_share(&disk(24.0));
        assert!((0.3..0.9).contains(&share), "{share}");
        let mut scan = block([20, 20, 20], [1.0; 3], [0; 3], [19; 3]);
        scan.values = scan
            .values
            .iter()
            .map(|value| 0.7 * value)
            .collect::<Vec<_>>()
            .into();
        assert_eq!(grey_share(&scan), 1.0);
        // A white object before grey, with a smoothed boundary: half white lies farther out than the boundary.
        let mut before_grey = disk(3.0);
        let values = before_grey.values.iter();
        let values: Vec<f64> = values.map(|value| 0.4 + 0.6 * value).collect();
        before_grey.values = values.into();
        // But for a ring two samples wide around a circle of radius 13: a fifth of the background.
        let share = grey_share(&before_grey);
        assert!((0.7..0.9).contains(&share), "{share}");
    }
}
