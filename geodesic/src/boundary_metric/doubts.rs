//! The doubts about the metric.

use super::estimate::Estimate;
use levelset::{Cause, Doubt};

impl<const D: usize> Estimate<D> {
    /// Returns the doubts about the result: multipliers that did not converge, a boundary that does not
    /// move as it should, grids that do not agree, and samples that are too coarse.
    pub fn doubts(&self) -> Vec<Doubt> {
        let ended = f64::from(u8::from(!self.flow.converged));
        let size = self.flow.metric();
        let relative = |error: Option<f64>| error.filter(|_| self.flow.deforms()).map(|e| e / size);
        let doubts = [
            Doubt::check(Cause::NotConverged, ended),
            Doubt::check(Cause::BoundaryVelocity, self.flow.residual),
            relative(self.error()).and_then(|error| Doubt::check(Cause::GridError, error)),
            relative(self.sampling_error)
                .and_then(|error| Doubt::check(Cause::SamplingError, error)),
        ];
        doubts.into_iter().flatten().collect()
    }
}
