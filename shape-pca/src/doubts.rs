//! The doubts about principal modes.

use crate::params::Metric;
use crate::pca::Pca;
use crate::variation::Variation;
use levelset::{Cause, Doubt};

impl<const D: usize> Pca<D> {
    /// Returns the sum of the loads relative to the sum of their norms, `|sum lambda_k u_k| / sum
    /// lambda_k |u_k|`, measured by the displacements: at most 1, whatever the number of shapes.
    pub fn imbalance(&self) -> f64 {
        self.balance / self.displacements.len() as f64
    }

    /// Returns the doubts about the modes: loads that do not balance, and an operator that is not
    /// positive definite. Modes of finite displacements depend on neither, unless the operator is their
    /// inner product.
    pub fn doubts(&self) -> Vec<Doubt> {
        let params = &self.space.params;
        let finite = params.variation == Variation::Displacement;
        let curved = !finite || params.metric == Metric::Hessian;
        let imbalance = (!finite).then(|| self.imbalance());
        let curvature = curved.then_some(self.least_curvature);
        let doubts = [
            imbalance.and_then(|figure| Doubt::check(Cause::StressBalance, figure)),
            curvature.and_then(|figure| Doubt::check(Cause::Indefinite, figure)),
        ];
        doubts.into_iter().flatten().collect()
    }
}
