//! The average under a displacement, such as a combination of modes, and what there is to doubt about it.

use fe_grid::{Field, ScalarField, certify_within};
use levelset::topology::Topology;
use levelset::{BoxEdge, Cause, Contour, ContourDistance, Doubt, contour, share_outside};

use super::draw::topology;
use crate::error::CliError;

/// The average and what a displacement makes of it.
pub(crate) struct Displaced<const D: usize> {
    /// The boundary of the average.
    pub outline: Contour<D>,
    /// That of the displaced shape.
    pub shape: Contour<D>,
    /// Its signed distance.
    pub level_set: ScalarField<f64, D>,
    /// The least determinant of the deformation on the cells of the average.
    pub min_det: f64,
}

impl<const D: usize> Displaced<D> {
    /// Displaces an object, of which the level 1/2 is the boundary.
    ///
    /// # Errors
    /// [`CliError`] for an average or a shape without a boundary.
    pub fn new(
        object: &ScalarField<f64, D>,
        displacement: &Field<f64, D, D>,
    ) -> Result<Self, CliError> {
        let grid = *object.grid();
        let outline = contour(object, 0.5, BoxEdge::Closed)?;
        let shape = outline.displaced(displacement, 1.0);
        let level_set = ContourDistance::new(&shape)?.sample(grid);
        let inside: Vec<bool> = (0..grid.n_cells())
            .map(|cell| object.as_slice()[grid.node_index(grid.cell(cell))] > 0.5)
            .collect();
        let u = displacement.as_slice();
        let certificate = certify_within(&grid, u, 0.0, f64::INFINITY, Some(&inside));
        Ok(Self {
            outline,
            shape,
            level_set,
            min_det: certificate.min_det,
        })
    }

    /// The doubts about the shape: folds, another topology than the average's, and what lies outside of the box.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn doubts(&self) -> Result<Vec<Doubt>, CliError> {
        let grid = self.level_set.grid();
        // Parts that lie on each other have holes where they do.
        let own = Topology::of(&self.level_set);
        let changes = own.differences(&topology(&self.outline, *grid)?);
        let outside = share_outside(&self.shape, grid)?;
        let doubts = [
            Doubt::below(Cause::Determinant, self.min_det, 0.0),
            Doubt::check(Cause::Topology, changes as f64),
            Doubt::check(Cause::OutsideBox, outside),
        ];
        Ok(doubts.into_iter().flatten().collect())
    }
}
