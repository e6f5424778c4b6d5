//! Stress in the deformed configuration.

use crate::kinematics::Volume;
use fe_grid::{Lane, Tensor, mutant, tensor};

/// Computes the Cauchy stress `D^-1 P A^T` from the first Piola–Kirchhoff stress `P`, at the image
/// of the point where `A = 1 + h` and `D = det A`; NaN if `D` is not positive.
///
/// Symmetric for every frame-indifferent law.
#[inline(always)]
pub fn cauchy_stress<L: Lane, const D: usize>(
    h: &Tensor<L, D>,
    first_piola: &Tensor<L, D>,
) -> Tensor<L, D> {
    let a = tensor::add_identity(h);
    let volume = Volume::of_determinant(tensor::determinant(&a));
    let kirchhoff = tensor::product_transposed(first_piola, &a);
    tensor::scale(
        &kirchhoff,
        mutant!(volume.inverse, CauchyVolume => L::one()),
    )
}
