//! Rigid alignment of points.

use levelset::RigidMotion;
use nalgebra::SVector;

/// The rigid motion that minimises the distance between corresponding points, and the residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Procrustes<const D: usize> {
    /// From the points to the others.
    pub motion: RigidMotion<D>,
    /// Root mean square distance after the motion.
    pub distance: f64,
    /// The same, relative to the root mean square distance of the target points from their
    /// centroid.
    pub residual: f64,
}

impl<const D: usize> Procrustes<D> {
    /// Aligns `points` with `others` by [`RigidMotion::nearest`].
    ///
    /// # Panics
    /// If their numbers differ, or are zero.
    pub fn new(points: &[[f64; D]], others: &[[f64; D]]) -> Self {
        assert!(!points.is_empty() && points.len() == others.len());
        let n = points.len() as f64;
        let pairs = points.iter().zip(others);
        let pairs = pairs.map(|(p, q)| (SVector::from(*p), SVector::from(*q)));
        let motion = RigidMotion::nearest(pairs.clone().map(|(p, q)| (1.0, p, q)));
        let moved = |p: SVector<f64, D>| SVector::from(motion.map(p.into()));
        let sum: f64 = pairs
            .clone()
            .map(|(p, q)| (moved(p) - q).norm_squared())
            .sum();
        let centroid = pairs.clone().map(|(_, q)| q).sum::<SVector<f64, D>>() / n;
        let spread: f64 = pairs.map(|(_, q)| (q - centroid).norm_squared()).sum();
        Self {
            motion,
            distance: (sum / n).sqrt(),
            residual: if spread > 0.0 {
                (sum / spread).sqrt()
            } else {
                0.0
            },
        }
    }
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
        assert!((found.motion.rotation() - rotation).norm() < 1e-12);
        assert!(found.distance < 1e-12 && found.residual < 1e-12);
        // Mirror images are not turned onto each other.
        let mirrored: Vec<[f64; 3]> = others.iter().map(|p| [p[0], p[1], -p[2]]).collect();
        let found = Procrustes::new(&points, &mirrored);
        assert!((found.motion.rotation().determinant() - 1.0).abs() < 1e-12);
        assert!(found.residual > 0.1);
    }
}
