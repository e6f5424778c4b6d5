//! Rigid alignment of points.

use fe_grid::VectorField;
use levelset::Contour;
use nalgebra::{SMatrix, SVector};

/// The rigid motion that minimises the distance between corresponding points, and the residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Procrustes<const D: usize> {
    rotation: SMatrix<f64, D, D>,
    shift: SVector<f64, D>,
    /// Root mean square distance after the motion.
    pub distance: f64,
    /// The same, relative to the root mean square distance of the target points from their
    /// centroid.
    pub residual: f64,
}

impl<const D: usize> Procrustes<D> {
    /// Aligns `points` with `others` by a proper rotation and a translation (Kabsch 1976).
    ///
    /// # Panics
    /// If their numbers differ, or are zero.
    pub fn new(points: &[[f64; D]], others: &[[f64; D]]) -> Self {
        assert!(!points.is_empty() && points.len() == others.len());
        let n = points.len() as f64;
        let centroid = |all: &[[f64; D]]| -> SVector<f64, D> {
            all.iter()
                .map(|p| SVector::from(*p))
                .sum::<SVector<f64, D>>()
                / n
        };
        let (from, to) = (centroid(points), centroid(others));
        let mut covariance = SMatrix::<f64, D, D>::zeros();
        let mut spread = 0.0;
        for (p, q) in points.iter().zip(others) {
            let (p, q) = (SVector::from(*p) - from, SVector::from(*q) - to);
            covariance += q * p.transpose();
            spread += q.norm_squared();
        }
        let rotation = nearest_rotation(&covariance);
        let shift = to - rotation * from;
        let squares = points.iter().zip(others).map(|(p, q)| {
            (rotation * SVector::from(*p) + shift - SVector::from(*q)).norm_squared()
        });
        let sum: f64 = squares.sum();
        Self {
            rotation,
            shift,
            distance: (sum / n).sqrt(),
            residual: if spread > 0.0 {
                (sum / spread).sqrt()
            } else {
                0.0
            },
        }
    }

    /// Moves a point.
    pub fn move_point(&self, point: [f64; D]) -> [f64; D] {
        (self.rotation * SVector::from(point) + self.shift).into()
    }

    /// Moves a boundary.
    pub fn apply(&self, contour: &Contour<D>) -> Contour<D> {
        contour.map(|p| self.move_point(p))
    }
}

/// The proper rotation `R` with the largest `tr(R^T A)`, by Jacobi rotations in all planes: of `A`
/// it keeps what no further rotation in a plane improves.
fn nearest_rotation<const D: usize>(a: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut rotation = SMatrix::<f64, D, D>::identity();
    for _ in 0..60 {
        let mut largest = 0.0f64;
        for i in 0..D {
            for j in i + 1..D {
                // tr((G R)^T A) with a turn G by t in the plane (i, j) is a cos t + b sin t + c.
                let b = a * rotation.transpose();
                let turn = (b[(j, i)] - b[(i, j)]).atan2(b[(i, i)] + b[(j, j)]);
                largest = largest.max(turn.abs());
                let mut plane = SMatrix::<f64, D, D>::identity();
                let (sin, cos) = turn.sin_cos();
                (plane[(i, i)], plane[(i, j)]) = (cos, -sin);
                (plane[(j, i)], plane[(j, j)]) = (sin, cos);
                rotation = plane * rotation;
            }
        }
        if largest < 1e-15 {
            break;
        }
    }
    rotation
}

/// The displaced points of a boundary: first by `onto`, the displacement of a shape's deformation
/// onto the average, then by `factor` times `u`. For `factor = -1` and the displacement that
/// represents the shape, the points return to approximately their initial positions, up to a rigid
/// motion.
pub fn there_and_back<const D: usize>(
    boundary: &Contour<D>,
    onto: &VectorField<f64, D>,
    u: &VectorField<f64, D>,
    factor: f64,
) -> Contour<D> {
    let add = |p: [f64; D], field: &VectorField<f64, D>, factor: f64| -> [f64; D] {
        let u = field.sample(p);
        std::array::from_fn(|k| p[k] + factor * u[k])
    };
    boundary.map(|p| add(add(p, onto, 1.0), u, factor))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn a_motion_is_found() {
        let rotation = *Rotation3::from_euler_angles(0.4, -1.1, 2.0).matrix();
        let points: Vec<[f64; 3]> = (0..20)
            .map(|i| [1.0, 1.7, 2.3].map(|f| (f * f64::from(i)).sin() * f))
            .collect();
        let others: Vec<[f64; 3]> = points
            .iter()
            .map(|p| (rotation * SVector::from(*p) + SVector::from([0.3, 0.1, -2.0])).into())
            .collect();
        let found = Procrustes::new(&points, &others);
        assert!((found.rotation - rotation).norm() < 1e-12);
        assert!(found.distance < 1e-12 && found.residual < 1e-12);
        // Mirror images are not turned onto each other.
        let mirrored: Vec<[f64; 3]> = others.iter().map(|p| [p[0], p[1], -p[2]]).collect();
        let found = Procrustes::new(&points, &mirrored);
        assert!((found.rotation.determinant() - 1.0).abs() < 1e-12);
        assert!(found.residual > 0.1);
    }
}
