//! What both forms make of a level set.

use fe_grid::composition::{Interpolant, Outside};
use fe_grid::{Field, Grid};
use levelset::Step;

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
