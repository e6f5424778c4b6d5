//! Initial rotations of the alignment.

use nalgebra::{DMatrix, SMatrix};

use super::matching::Matching;
use levelset::rigid_motion::{axis_rotations, covering_rotations, determinant};

/// Starts closer than this angle (2D, 3D), in radians, lead to the same minimum.
pub(super) const SEPARATION: [f64; 2] = [0.08, 0.3];

/// Returns the initial rotations: the identity; those that map the principal axes of the shape onto
/// those of its target, in every order and direction; and an even covering of all rotations.
pub(super) fn rotations<const D: usize>(matching: &Matching<'_, D>) -> Vec<SMatrix<f64, D, D>> {
    let target = principal_axes(&matching.target_covariance());
    let shape = principal_axes(&matching.shape_covariance());
    let mut list = vec![SMatrix::identity()];
    list.extend(axis_rotations().map(|s| target * s * shape.transpose()));
    list.extend(covering_rotations());
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
