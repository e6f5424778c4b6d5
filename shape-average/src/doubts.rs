//! The doubts about averages.

use crate::joint::JointResult;
use crate::params::AverageParams;
use crate::result::{AverageResult, Turned, unconverged};
use fe_grid::minimise::Status;
use levelset::{Cause, Doubt, Hausdorff};

impl<const D: usize> AverageResult<D> {
    /// Returns the doubts about an average that was computed with these parameters: levels that did
    /// not converge, an energy too far above the minimum, a determinant at its lower bound, an average of
    /// which no shape shows a part, shapes that lie turned, and shapes, or components of
    /// them, that are not deformed onto the average.
    pub fn doubts(&self, params: &AverageParams) -> Vec<Doubt> {
        let whole = [
            not_converged(unconverged(&self.levels), self.status),
            self.remaining(),
            Doubt::determinant(self.certificate.min_det, params.min_determinant),
            Doubt::check(Cause::Unseen, self.unseen_share()),
        ];
        let shapes = self.mismatched(&self.dice, &self.hausdorff);
        let parts = self.components.iter().enumerate().flat_map(|(c, part)| {
            let doubts = self.mismatched(&part.dice, &part.hausdorff);
            doubts.map(move |doubt| doubt.within(c))
        });
        let whole = whole.into_iter().flatten();
        let turned = self.turned.iter().filter_map(Turned::doubt);
        whole.chain(turned).chain(shapes).chain(parts).collect()
    }

    /// The doubt about the energy above the minimum, if that was estimated.
    fn remaining(&self) -> Option<Doubt> {
        Doubt::check(Cause::RemainingEnergy, self.remaining_share()?)
    }

    /// Returns the energy above the minimum relative to the weighted elastic energy, if it was estimated.
    pub fn remaining_share(&self) -> Option<f64> {
        Some(self.energy.remaining? / self.energy.elastic_scale())
    }

    /// The doubts about the deformations onto the average, from the overlap and the distance of each.
    fn mismatched<'a>(
        &self,
        overlaps: &'a [f64],
        distances: &'a [Option<Hausdorff>],
    ) -> impl Iterator<Item = Doubt> + use<'a, D> {
        let spacing = self.average.grid().spacing();
        let measured = overlaps.iter().zip(distances).enumerate();
        measured.flat_map(move |(shape, (dice, distance))| {
            // Without a boundary, the overlap alone decides.
            let [mean, largest] = distance.map_or([f64::INFINITY, 0.0], |distance| {
                [distance.mean, distance.maximum].map(|d| d / spacing)
            });
            let doubts = [
                Doubt::overlap(Cause::Overlap, *dice, mean),
                Doubt::check(Cause::BoundaryDistance, largest),
            ];
            let doubts = doubts.into_iter().flatten();
            doubts.map(move |doubt| doubt.about(shape))
        })
    }
}

impl<const D: usize> JointResult<D> {
    /// Returns the doubts about a joint average that was computed with these parameters of the
    /// average: levels that did not converge, an estimate of the remaining energy above its limit, a determinant
    /// at its lower bound, images whose edges are not those of the average or that lack some of these, and images that differ more after
    /// they were deformed.
    pub fn doubts(&self, params: &AverageParams) -> Vec<Doubt> {
        let statuses = self.levels.iter().map(|level| level.status);
        let statuses = statuses.filter(|status| !status.converged());
        let doubts = [
            not_converged(statuses, self.status),
            self.energy()
                .remaining_share()
                .and_then(|share| Doubt::check(Cause::RemainingEnergy, share)),
            Doubt::determinant(self.certificate.min_det, params.min_determinant),
            Doubt::check(Cause::Spread, self.spread_share()),
        ];
        let of_images = |cause: Cause, figures: &[f64]| {
            let figures = figures.iter().enumerate();
            let doubts = figures.filter_map(move |(i, x)| Some(Doubt::check(cause, *x)?.about(i)));
            doubts.collect::<Vec<_>>()
        };
        let of_images = [
            of_images(Cause::EdgeOverlap, &self.edge_overlaps),
            of_images(Cause::UnmatchedEdges, &self.unmatched_shares),
            of_images(Cause::SolidEdges, &self.solid_shares),
        ];
        doubts
            .into_iter()
            .flatten()
            .chain(of_images.into_iter().flatten())
            .collect()
    }
}

impl Turned {
    /// The doubt about the deformation that does not turn the shape.
    pub fn doubt(&self) -> Option<Doubt> {
        let [as_it_lies, turned] = self.mismatches;
        let doubt = Doubt::check(Cause::Turned, turned / as_it_lies);
        doubt.map(|doubt| doubt.about(self.shape))
    }
}

/// The doubt about levels that ended before they converged, and the whole.
fn not_converged(levels: impl Iterator<Item = Status>, whole: Status) -> Option<Doubt> {
    let ended = levels.count().max(usize::from(!whole.converged()));
    Doubt::check(Cause::NotConverged, ended as f64)
}
