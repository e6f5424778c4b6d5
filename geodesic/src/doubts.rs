//! The doubts about paths.

use crate::arrival::Arrival;
use crate::calculus::Extension;
use crate::params::GeodesicParams;
use crate::result::Geodesic;
use levelset::{Cause, Doubt};

/// Energies below this are those of rounding errors: of rigid motions.
const NEGLIGIBLE: f64 = 1e-12;

impl<const D: usize> Geodesic<D> {
    /// Returns the doubts about the path, computed with these parameters: a minimiser that did not
    /// converge, a path that does not arrive at the end shape, one that arrives with other parts and holes, one that
    /// merges and splits more than its ends differ in, one that
    /// lacks what is hidden, shapes that leave the box, and a determinant at its lower bound.
    pub fn doubts(&self, params: &GeodesicParams) -> Vec<Doubt> {
        let ended = f64::from(u8::from(!self.status.converged()));
        // The boundary of a hidden part is unknown.
        let arrival = self.arrival.map(|found| found.doubts());
        let doubts = [
            Doubt::check(Cause::NotConverged, ended),
            Doubt::determinant(self.certificate.min_det, params.min_determinant),
            Arrival::doubt_of_overlap(self.arrival, self.dice_end, self.gap_end),
            Doubt::check(Cause::Topology, self.other_topology as f64),
            Doubt::check(Cause::NeedlessContacts, self.needless_contacts as f64),
            Doubt::check(Cause::OutsideBox, self.outside),
            self.whole_end.and_then(|whole| whole.doubt()),
        ];
        let doubts = doubts.into_iter().flatten();
        doubts.chain(arrival.into_iter().flatten()).collect()
    }
}

impl<const D: usize> Extension<D> {
    /// Returns the doubts about an extension by this number of steps: steps that were not found,
    /// deformations that fold, shapes that have left the box, and steps whose energies differ. The energy of the
    /// step before the first is that of the last of the path that was extended, if there is one.
    pub fn doubts(&self, steps: usize, before: Option<f64>) -> Vec<Doubt> {
        let missing = steps.saturating_sub(self.step_energies.len());
        let energies: Vec<f64> = before.iter().chain(&self.step_energies).copied().collect();
        let change = energies
            .windows(2)
            .filter(|pair| pair[0].max(pair[1]) > NEGLIGIBLE)
            .map(|pair| (pair[1] / pair[0] - 1.0).abs())
            .fold(0.0, f64::max);
        let doubts = [
            Doubt::check(Cause::NotConverged, missing as f64),
            Doubt::below(Cause::Determinant, self.certificate.min_det, 0.0),
            Doubt::check(Cause::OutsideBox, self.outside),
            Doubt::check(Cause::StepEnergy, change),
        ];
        doubts.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::Certificate;

    /// A step that differs from the one before it, also from the last of the given path, is doubtful.
    #[test]
    fn steps_of_other_energies_are_doubtful() {
        let extension = |energies: &[f64]| Extension::<2> {
            pieces: Vec::new(),
            step_energies: energies.to_vec(),
            certificate: Certificate::IDENTITY,
            outside: 0.0,
            reports: Vec::new(),
        };
        let causes = |energies: &[f64], before| -> Vec<Cause> {
            let doubts = extension(energies).doubts(energies.len(), before);
            doubts.iter().map(|doubt| doubt.cause).collect()
        };
        assert_eq!(causes(&[1.0, 0.95, 0.9], Some(1.05)), []);
        assert_eq!(causes(&[1.0, 1.0], Some(1.2)), [Cause::StepEnergy]);
        assert_eq!(causes(&[1.0, 0.85], None), [Cause::StepEnergy]);
    }
}
