//! The inner product `g` in which the modes are orthonormal.

use crate::operator::Compound;
use crate::params::Metric;
use crate::product::object_product;
use fe_grid::{ScalarField, VectorField, mutant};

/// Computes the linear form `g(u, .)`.
pub(crate) fn dual<const D: usize>(
    metric: Metric,
    object: &ScalarField<f64, D>,
    compound: &Compound<D>,
    u: &VectorField<f64, D>,
) -> Vec<f64> {
    match mutant!(metric, HessianMetric => Metric::L2) {
        Metric::L2 => object_product(object, u.as_slice()),
        Metric::Hessian => compound.apply(u.as_slice()),
    }
}
