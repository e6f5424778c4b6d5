//! The doubts about principal modes.

use crate::pca::Pca;
use levelset::{Cause, Doubt};

impl<const D: usize> Pca<D> {
    /// Returns the sum of the loads relative to the sum of their norms, `|sum lambda_k u_k| / sum
    /// lambda_k |u_k|`, measured by the displacements: at most 1, whatever the number of shapes.
    pub fn imbalance(&self) -> f64 {
        self.balance / self.displacements.len() as f64
    }

    /// Returns the doubts about the modes: loads that do not balance, and an operator that is not
    /// positive definite.
    pub fn doubts(&self) -> Vec<Doubt> {
        let doubts = [
            Doubt::check(Cause::StressBalance, self.imbalance()),
            Doubt::check(Cause::Indefinite, self.least_curvature),
        ];
        doubts.into_iter().flatten().collect()
    }
}
