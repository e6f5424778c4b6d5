//! Initial rotations of the alignment.

use std::f64::consts::{SQRT_2, TAU};

use nalgebra::{DMatrix, SMatrix};

use super::matching::Matching;
use levelset::rigid_motion::{axis_rotations, determinant, plane_rotation};

/// Number of angles of the even covering in 2D: every three degrees, twelve per period of a star
/// with ten arms.
const N_ANGLES: usize = 120;
/// Number of rotations of the even covering in 3D, about 25 degrees from each other.
const N_ROTATIONS: usize = 360;
/// Starts closer than this angle (2D, 3D), in radians, lead to the same minimum.
pub(super) const SEPARATION: [f64; 2] = [0.08, 0.3];

/// Returns the initial rotations: the identity; those that map the principal axes of the shape onto
/// those of its target, in every order and direction; and an even covering of all rotations.
pub(super) fn rotations<const D: usize>(matching: &Matching<'_, D>) -> Vec<SMatrix<f64, D, D>> {
    let target = principal_axes(&matching.target_covariance());
    let shape = principal_axes(&matching.shape_covariance());
    let mut list = vec![SMatrix::identity()];
    list.extend(axis_rotations().map(|s| target * s * shape.transpose()));
    list.extend(covering());
    list
}

/// Returns the principal axes as the columns of a proper rotation, largest moment first.
fn principal_axes<const D: usize>(covariance: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let dynamic = DMatrix::from_fn(D, D, |i, j| covariance[(i, j)]);
    let eigen = dynamic.symmetric_eigen();
    let mut order: Vec<usize> = (0..D).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let mut axes = SMatrix::from_fn(|i, j| eigen.eigenvectors[(i, order[j])]);
    if determinant(&axes) < 0.0 {
        for i in 0..D {
            axes[(i, D - 1)] = -axes[(i, D - 1)];
        }
    }
    axes
}

/// Returns rotations that cover the rotation group evenly.
fn covering<const D: usize>() -> Vec<SMatrix<f64, D, D>> {
    if D == 2 {
        return (1..N_ANGLES)
            .map(|i| plane_rotation(0, 1, TAU * i as f64 / N_ANGLES as f64))
            .collect();
    }
    (0..N_ROTATIONS).map(spiral).collect()
}

/// Returns one point of a spiral through the unit quaternions, as a rotation: M. Alexa,
/// *Super-Fibonacci spirals: fast, low-discrepancy sampling of SO(3)*, CVPR 2022.
fn spiral<const D: usize>(i: usize) -> SMatrix<f64, D, D> {
    /// The positive root of `x^4 = x + 4`.
    const PSI: f64 = 1.533_751_168_755_204_3;
    let s = i as f64 + 0.5;
    let t = s / N_ROTATIONS as f64;
    let (inner, outer) = (t.sqrt(), (1.0 - t).sqrt());
    let (alpha, beta) = (TAU * s / SQRT_2, TAU * s / PSI);
    let (x, y) = (inner * alpha.sin(), inner * alpha.cos());
    let (z, w) = (outer * beta.sin(), outer * beta.cos());
    let rows = [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
        ],
        [
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
        ],
        [
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ];
    SMatrix::from_fn(|i, j| rows[i][j])
}

#[cfg(test)]
mod tests {
    use super::*;
    use levelset::rigid_motion::angle_between;

    #[test]
    fn coverings_are_rotations_and_leave_no_gap() {
        fn check<const D: usize>(n: usize, gap: f64) {
            let list = covering::<D>();
            assert_eq!(list.len(), n);
            for r in &list {
                assert!((r.transpose() * r - SMatrix::identity()).norm() < 1e-13);
                assert!((determinant(r) - 1.0).abs() < 1e-13);
            }
            // Rotations far from the list itself: products of its elements.
            for (i, a) in list.iter().enumerate() {
                let probe = a * list[(7 * i + 3) % list.len()];
                let near = list.iter().map(|r| angle_between(r, &probe));
                assert!(near.fold(f64::INFINITY, f64::min) < gap);
            }
        }
        check::<2>(N_ANGLES - 1, 3.01f64.to_radians());
        check::<3>(N_ROTATIONS, 35f64.to_radians());
    }
}
