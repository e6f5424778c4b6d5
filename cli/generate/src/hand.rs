//! Hands: a palm with five fingers.

use crate::implicit::Implicit;
use crate::solid::{box_value, thickened};

/// Half the sides of the palm, the radius of its corners left out.
const PALM: [f64; 2] = [0.09, 0.085];
/// Radius of the corners of the palm.
const CORNER: f64 = 0.04;
/// Height of the centre of the palm under the origin.
const DROP: f64 = 0.13;
/// Where fingers begin, relative to the centre of the palm: the thumb first.
const ROOTS: [[f64; 2]; 5] = [
    [-0.09, 0.03],
    [-0.1, -0.09],
    [-0.034, -0.1],
    [0.034, -0.1],
    [0.1, -0.09],
];
/// Lengths of the fingers from there to the middle of their round ends.
const LENGTHS: [f64; 5] = [0.17, 0.22, 0.26, 0.24, 0.18];
/// Half their widths.
const HALF_WIDTHS: [f64; 5] = [0.028, 0.024, 0.024, 0.024, 0.022];

/// A hand seen from its palm, the fingers towards smaller `y` (upwards in a picture). In 3D it has the
/// thickness of the thumb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// Directions of the fingers in degrees, from upright towards larger `x`, the thumb first.
    pub angles: [f64; 5],
    /// Their lengths relative to the usual ones.
    pub lengths: [f64; 5],
}

impl Hand {
    fn flat_value(&self, [x, y]: [f64; 2]) -> f64 {
        let [x, y] = [x, y - DROP];
        let mut value = box_value([x, y], PALM) + CORNER;
        for (k, [left, top]) in ROOTS.into_iter().enumerate() {
            let (sin, cos) = self.angles[k].to_radians().sin_cos();
            let length = self.lengths[k] * LENGTHS[k];
            let (px, py) = (x - left, y - top);
            // The nearest point of the middle line.
            let along = (px * sin - py * cos).clamp(0.0, length);
            let away = (px - along * sin).hypot(py + along * cos);
            value = value.max(HALF_WIDTHS[k] - away);
        }
        value
    }
}

impl<const D: usize> Implicit<D> for Hand {
    fn value(&self, point: [f64; D]) -> f64 {
        thickened(point, HALF_WIDTHS[0], |flat| self.flat_value(flat))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fingers_point_where_they_are_told() {
        let hand = Hand {
            angles: [-60.0, -10.0, 0.0, 0.0, 20.0],
            lengths: [1.0, 1.0, 1.0, 0.5, 1.0],
        };
        let value = |x, y| hand.value([x, y]);
        // Up the middle finger, and nothing beside it.
        assert!((value(-0.034, DROP - 0.3) - 0.024).abs() < 1e-12);
        assert!(value(0.0, DROP - 0.3) < 0.0);
        // A short ring finger ends at half its length, and the thumb points to the left.
        assert!(value(0.034, DROP - 0.21) > 0.0 && value(0.034, DROP - 0.26) < 0.0);
        assert!(value(-0.2, DROP - 0.033) > 0.0 && value(0.2, DROP - 0.033) < 0.0);
        let solid: f64 = hand.value([0.0, DROP, 0.0]);
        assert!((solid - HALF_WIDTHS[0]).abs() < 1e-12);
    }
}
