//! Normal variations of a shape.

use super::boundary::BoundaryPoint;
use crate::error::GeodesicError;
use fe_grid::ScalarField;

/// The normal velocity of a boundary, positive outwards.
#[derive(Clone, Debug)]
pub enum Variation<const D: usize> {
    /// Speed one everywhere: the shape grows as in the dilation of morphology.
    Growth,
    /// A harmonic of this degree around a centre: `cos(N t)` of the angle `t` from the first axis in
    /// 2D, the Legendre polynomial `P_N(cos t)` of the angle from the last axis in 3D.
    Harmonic {
        /// The degree `N`.
        degree: u32,
        /// The centre.
        centre: [f64; D],
    },
    /// The translation with this velocity `a`: `a . n`.
    Translation([f64; D]),
    /// The values of this field on the boundary.
    Nodal(ScalarField<f64, D>),
}

impl<const D: usize> Variation<D> {
    /// The variation towards another shape, to first order: the difference of the signed distances,
    /// both positive inside.
    ///
    /// # Errors
    /// [`GeodesicError::GridsDiffer`].
    pub fn towards(
        start: &ScalarField<f64, D>,
        end: &ScalarField<f64, D>,
    ) -> Result<Self, GeodesicError> {
        if start.grid() != end.grid() {
            return Err(GeodesicError::GridsDiffer);
        }
        let mut difference = end.clone();
        for (d, u) in difference.as_mut_slice().iter_mut().zip(start.as_slice()) {
            *d -= u;
        }
        Ok(Self::Nodal(difference))
    }

    /// The normal velocity at a point of the boundary.
    pub fn at(&self, point: &BoundaryPoint<D>) -> f64 {
        match self {
            Self::Growth => 1.0,
            Self::Harmonic { degree, centre } => {
                let ray: [f64; D] = std::array::from_fn(|k| point.position[k] - centre[k]);
                if D == 2 {
                    (f64::from(*degree) * ray[1].atan2(ray[0])).cos()
                } else {
                    let size = ray.iter().map(|x| x * x).sum::<f64>().sqrt();
                    legendre(*degree, ray[D - 1] / size.max(f64::MIN_POSITIVE))
                }
            }
            Self::Translation(velocity) => (0..D).map(|k| velocity[k] * point.normal[k]).sum(),
            Self::Nodal(field) => field.sample(point.position)[0],
        }
    }
}

/// The Legendre polynomial `P_n(x)`, by its recursion.
fn legendre(n: u32, x: f64) -> f64 {
    let (mut before, mut now) = (0.0, 1.0);
    for k in 1..=n {
        let k = f64::from(k);
        let next = ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k;
        (before, now) = (now, next);
    }
    now
}

#[cfg(test)]
mod tests {
    use super::legendre;

    #[test]
    fn legendre_polynomials_are_those_of_the_tables() {
        let x = 0.3f64;
        let expected = [1.0, x, 1.5 * x * x - 0.5, 2.5 * x * x * x - 1.5 * x];
        for (n, expected) in (0..).zip(expected) {
            assert!((legendre(n, x) - expected).abs() < 1e-15, "{n}");
        }
        assert!((legendre(40, 1.0) - 1.0).abs() < 1e-12);
    }
}
