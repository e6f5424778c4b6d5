//! The doubts about the metric.

use super::estimate::Estimate;
use levelset::{Cause, Doubt};

impl<const D: usize> Estimate<D> {
    /// Returns the doubts about the result: multipliers that did not converge, a boundary that does not
    /// move as it should, and grids that do not agree.
    pub fn doubts(&self) -> Vec<Doubt> {
        let ended = f64::from(u8::from(!self.flow.converged));
        let size = self.flow.metric();
        let change = self
            .error()
            .filter(|_| self.flow.deforms())
            .map(|e| e / size);
        let doubts = [
            Doubt::check(Cause::NotConverged, ended),
            Doubt::check(Cause::BoundaryVelocity, self.flow.residual),
            change.and_then(|change| Doubt::check(Cause::GridError, change)),
        ];
        doubts.into_iter().flatten().collect()
    }
}
