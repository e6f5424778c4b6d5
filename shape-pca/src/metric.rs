//! The inner product `g` in which the modes are orthonormal.

use crate::operator::Compound;
use crate::params::Metric;
use crate::product::object_product;
use fe_grid::{ScalarField, VectorField};

/// Computes the linear form `g(u, .)`.
pub(crate) fn dual<const D: usize>(
    metric: Metric,
    object: &ScalarField<f64, D>,
    compound: &Compound<D>,
    u: &VectorField<f64, D>,
) -> Vec<f64> {
    match metric {
        Metric::L2 => object_product(object, u.as_slice()),
        Metric::Hessian => compound.apply(u.as_slice()),
    }
}
