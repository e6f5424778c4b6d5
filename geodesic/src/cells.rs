//! What both forms make of a level set.

use fe_grid::composition::{Interpolant, Outside};
use fe_grid::{Field, Grid, Lane};
use levelset::Step;

/// What object and void weigh in the energy of a deformation, as functions of the level set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectWeights {
    /// The smooth indicator `chi` of the object.
    pub indicator: Step,
    /// Stiffness `delta` of the void under the law, relative to the object.
    pub void_stiffness: f64,
    /// Viscosity `nu` of the void, without a barrier.
    pub void_viscosity: f64,
}

impl ObjectWeights {
    /// The weight `(1 - delta) chi + delta` of the law, and the weight `nu (1 - chi)` of the void's
    /// viscosity.
    #[inline(always)]
    pub(crate) fn at<L: Lane>(&self, level_set: L) -> (L, L) {
        let chi = self.indicator.value(level_set);
        let delta = L::splat(self.void_stiffness);
        let elastic = chi.mul_add(L::one() - delta, delta);
        (elastic, (L::one() - chi).scale(self.void_viscosity))
    }
}

/// A level set as it goes on outside the box.
pub(crate) fn continued<const D: usize>(field: &Field<f64, D, 1>) -> Interpolant<'_, f64, D> {
    Interpolant::new(*field.grid(), field.as_slice()).with_outside(Outside::Falling)
}

/// The cells with a corner at which the indicator of a level set is not zero.
pub(crate) fn solid_cells<const D: usize>(
    grid: &Grid<D>,
    level_set: &[f64],
    indicator: Step,
) -> Vec<bool> {
    let strides = grid.strides();
    let offsets: Vec<usize> = (0..1usize << D)
        .map(|c| (0..D).map(|k| (c >> k & 1) * strides[k]).sum())
        .collect();
    (0..grid.n_cells())
        .map(|cell| {
            let first = grid.node_index(grid.cell(cell));
            let inside = |offset: &usize| indicator.value(level_set[first + offset]) > 0.0;
            offsets.iter().any(inside)
        })
        .collect()
}
