//! Shapes rotated and placed in the unit box.

use crate::implicit::Implicit;

/// A shape rotated about its origin and placed in the unit box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed<S, const D: usize> {
    /// The shape, drawn about the origin.
    pub shape: S,
    /// Angle in degrees from the first axis towards the second; about the third axis in 3D.
    pub rotation: f64,
    /// Position of the shape's origin.
    pub centre: [f64; D],
}

impl<S, const D: usize> Placed<S, D> {
    /// The shape with its origin at the centre of the unit box, not rotated.
    pub fn centred(shape: S) -> Self {
        Self {
            shape,
            rotation: 0.0,
            centre: [0.5; D],
        }
    }
}

impl<S: Implicit<D>, const D: usize> Implicit<D> for Placed<S, D> {
    fn value(&self, point: [f64; D]) -> f64 {
        let mut local: [f64; D] = std::array::from_fn(|k| point[k] - self.centre[k]);
        let (sin, cos) = self.rotation.to_radians().sin_cos();
        (local[0], local[1]) = (
            cos * local[0] + sin * local[1],
            cos * local[1] - sin * local[0],
        );
        self.shape.value(local)
    }

    fn stretch(&self) -> f64 {
        self.shape.stretch()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::Ellipsoid;

    #[test]
    fn turning_goes_from_x_to_y() {
        let bar = Placed {
            shape: Ellipsoid { radii: [0.4, 0.1] },
            rotation: 90.0,
            centre: [0.5, 0.5],
        };
        assert!(bar.value([0.5, 0.85]) > 0.0);
        assert!(bar.value([0.85, 0.5]) < 0.0);
        let tilted = Placed {
            rotation: 30.0,
            ..bar
        };
        assert!(tilted.value([0.5 + 0.3, 0.5 + 0.17]) > 0.0);
        assert!(tilted.value([0.5 + 0.3, 0.5 - 0.17]) < 0.0);
    }
}
