//! The doubts about segmentations.

use super::solve::Segmentation;
use levelset::{Cause, Doubt};

impl<const D: usize> Segmentation<D> {
    /// Returns the doubts about a segmentation: levels that ended before they converged.
    pub fn doubts(&self) -> Vec<Doubt> {
        let ended = self.levels.iter().filter(|level| !level.status.converged());
        let doubt = Doubt::check(Cause::NotConverged, ended.count() as f64);
        doubt.into_iter().collect()
    }
}
