//! The doubts about paths.

use crate::calculus::Extension;
use crate::params::GeodesicParams;
use crate::result::Geodesic;
use levelset::{Cause, Doubt};

impl<const D: usize> Geodesic<D> {
    /// Returns the doubts about the path, computed with these parameters: a minimiser that did not
    /// converge, a path that does not arrive at the end shape, one that arrives with other parts and holes, one that
    /// lacks what is hidden, and a determinant at its lower bound.
    pub fn doubts(&self, params: &GeodesicParams) -> Vec<Doubt> {
        let ended = f64::from(u8::from(!self.status.converged()));
        // The boundary of a hidden part is unknown.
        let arrival = self.arrival.map(|found| found.doubts());
        let doubts = [
            Doubt::check(Cause::NotConverged, ended),
            Doubt::determinant(self.certificate.min_det, params.min_determinant),
            Doubt::overlap(Cause::PathEnd, self.dice_end, self.gap_end),
            Doubt::check(Cause::Topology, self.other_topology as f64),
            self.whole_end.and_then(|whole| whole.doubt()),
        ];
        let doubts = doubts.into_iter().flatten();
        doubts.chain(arrival.into_iter().flatten()).collect()
    }
}

impl<const D: usize> Extension<D> {
    /// Returns the doubts about an extension by this number of steps: steps that were not found,
    /// deformations that fold, and shapes that have left the box.
    pub fn doubts(&self, steps: usize) -> Vec<Doubt> {
        let missing = steps.saturating_sub(self.step_energies.len());
        let doubts = [
            Doubt::check(Cause::NotConverged, missing as f64),
            Doubt::below(Cause::Determinant, self.certificate.min_det, 0.0),
            Doubt::check(Cause::OutsideBox, self.outside),
        ];
        doubts.into_iter().flatten().collect()
    }
}
