//! The doubts about paths.

use crate::calculus::Extension;
use crate::error::GeodesicError;
use crate::overlap::moved;
use crate::params::GeodesicParams;
use crate::result::Geodesic;
use crate::shape::{Known, Shape, on_grid};
use fe_grid::ScalarField;
use levelset::{BoxEdge, Cause, Doubt, contour, hausdorff};

impl<const D: usize> Geodesic<D> {
    /// Returns the doubts about the path between two shapes, computed with these parameters: a
    /// minimiser that did not converge, a path that does not arrive at the end shape, and a
    /// determinant at its lower bound.
    ///
    /// # Errors
    /// [`GeodesicError::Shape`] for a shape without a boundary.
    pub fn doubts(
        &self,
        start: &Shape<D>,
        end: &Shape<D>,
        params: &GeodesicParams,
    ) -> Result<Vec<Doubt>, GeodesicError> {
        let ended = f64::from(u8::from(!self.status.converged()));
        let mut doubts = vec![
            Doubt::check(Cause::NotConverged, ended),
            Doubt::determinant(self.certificate.min_det, params.min_determinant),
            Doubt::overlap(Cause::PathEnd, self.dice_end, self.gap_end),
        ];
        // The boundary of a hidden part is unknown.
        if [start, end]
            .map(Shape::known)
            .iter()
            .all(|known| matches!(known, Known::Everywhere))
        {
            let distance = self.end_distance(start, end)?;
            doubts.push(Doubt::check(Cause::BoundaryDistance, distance));
        }
        Ok(doubts.into_iter().flatten().collect())
    }

    /// Returns the largest distance between the boundaries of the deformed start shape and of the
    /// end shape, in spacings of the grid.
    fn end_distance(&self, start: &Shape<D>, end: &Shape<D>) -> Result<f64, GeodesicError> {
        let grid = *self.level_sets[0].grid();
        let outline = |u: &ScalarField<f64, D>| contour(&on_grid(&grid, u), 0.0, BoxEdge::Open);
        let [from, to] = match self.domain {
            Some(domain) => domain.order(start, end),
            None => [start, end],
        };
        let from = outline(&from.union())?;
        let carried = match &self.across {
            Some(across) => moved(&from, across),
            None => self
                .displacements
                .iter()
                .fold(from, |c, phi| moved(&c, phi)),
        };
        Ok(hausdorff(&carried, &outline(&to.union())?)?.maximum / grid.spacing())
    }
}

impl<const D: usize> Extension<D> {
    /// Returns the doubts about an extension by this number of steps: steps that were not found, and
    /// deformations that fold.
    pub fn doubts(&self, steps: usize) -> Vec<Doubt> {
        let missing = steps.saturating_sub(self.step_energies.len());
        let doubts = [
            Doubt::check(Cause::NotConverged, missing as f64),
            Doubt::below(Cause::Determinant, self.certificate.min_det, 0.0),
        ];
        doubts.into_iter().flatten().collect()
    }
}
