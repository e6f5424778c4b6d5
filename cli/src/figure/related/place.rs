//! Where the mean of shapes that have no place is drawn.

use super::curve::{Curve, Point, plus};
use super::hausdorff;
use super::landmarks::{aligned, centroid, preshape};

/// A mean up to similarities, of this length, at the mean place of some curves of as many points. Of the
/// positions in which it fits one of the curves best, it has the one with the least sum of distances from
/// all: one with symmetries fits in several.
pub(super) fn placed(mean: &[Point], length: f64, curves: &[Curve]) -> Curve {
    let n = curves.len() as f64;
    let centre = curves.iter().fold([0.0; 2], |sum, curve| {
        plus(sum, 1.0 / n, centroid(&curve.points))
    });
    let mut best = (f64::INFINITY, None);
    for like in curves {
        let Some(shape) = preshape(&like.points) else {
            continue;
        };
        let fitted = aligned(&shape, mean);
        let own = Curve { points: fitted };
        let scale = length / own.length();
        let points = own.points.iter().map(|p| plus(centre, scale, *p));
        let own = Curve {
            points: points.collect(),
        };
        let far: f64 = curves.iter().map(|c| hausdorff::distance(&own, c)).sum();
        if far < best.0 {
            best = (far, Some(own));
        }
    }
    best.1.unwrap_or_else(|| Curve {
        points: mean.to_vec(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bar fits a bar in two positions: of a bent mean the one that is bent as the other shape is drawn.
    #[test]
    fn a_mean_is_turned_as_all_shapes_are() {
        let bent = |height: f64| Curve {
            points: vec![
                [-0.3, height],
                [0.0, 0.0],
                [0.3, height],
                [0.3, height + 0.1],
                [0.0, 0.1],
                [-0.3, height + 0.1],
            ],
        };
        // Alone, the straight bar has the mean bent up or down, whichever fits by rounding.
        for height in [0.3, -0.3] {
            let curves = [bent(0.0), bent(height)].map(|curve| curve.resampled(64));
            let mean = bent(0.5 * height).resampled(64);
            // From a point at either end.
            for first in [0, 32] {
                let mut shape = preshape(&mean.points).unwrap();
                shape.rotate_left(first);
                let found = placed(&shape, mean.length(), &curves);
                let distances = found.points.iter().map(|p| mean.nearest(*p).distance);
                let off = distances.fold(0.0, f64::max);
                // Landmarks at equal distances are not those of the mean.
                assert!(off < 0.03, "{height}, {first}: {off}");
            }
        }
    }
}
