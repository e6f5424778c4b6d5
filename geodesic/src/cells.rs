//! Functions of level sets and step energies shared by both forms.

use fe_grid::composition::{Interpolant, Outside};
use fe_grid::{Field, Grid, Lane, mutant};
use levelset::Step;

/// Weights of object and void in the energy of a deformation, as functions of the level set.
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
    /// Returns the weight `(1 - delta) chi + delta` of the law, and the weight `nu (1 - chi)` of
    /// the void's viscosity.
    #[inline(always)]
    pub(crate) fn at<L: Lane>(&self, level_set: L) -> (L, L) {
        let chi = self.indicator.value(level_set);
        let delta = L::splat(self.void_stiffness);
        let elastic = chi.mul_add(L::one() - delta, delta);
        (elastic, (L::one() - chi).scale(self.void_viscosity))
    }
}

/// Returns a level set extended outside the box.
pub(crate) fn continued<const D: usize>(field: &Field<f64, D, 1>) -> Interpolant<'_, f64, D> {
    Interpolant::new(*field.grid(), field.as_slice()).with_outside(Outside::Falling)
}

/// Returns the cells with a corner at which the indicator of a level set is not zero.
pub(crate) fn solid_cells<const D: usize>(
    grid: &Grid<D>,
    level_set: &[f64],
    indicator: Step,
) -> Vec<bool> {
    cells_with_corner(grid, |node| indicator.value(level_set[node]) > 0.0)
}

/// Returns the cells with a corner inside.
pub(crate) fn object_cells<const D: usize>(level_set: &Field<f64, D, 1>) -> Vec<bool> {
    let values = level_set.as_slice();
    cells_with_corner(level_set.grid(), |node| values[node] > 0.0)
}

/// Returns the cells with a corner that satisfies a predicate of its node.
pub(crate) fn cells_with_corner<const D: usize>(
    grid: &Grid<D>,
    holds: impl Fn(usize) -> bool,
) -> Vec<bool> {
    let strides = grid.strides();
    let offsets: Vec<usize> = (0..1usize << D)
        .map(|c| (0..D).map(|k| (c >> k & 1) * strides[k]).sum())
        .collect();
    (0..grid.n_cells())
        .map(|cell| {
            let first = grid.node_index(grid.cell(cell));
            offsets.iter().any(|offset| holds(first + offset))
        })
        .collect()
}

/// Returns the length `sum sqrt W_k` of a path with these step energies.
pub(crate) fn length(step_energies: &[f64]) -> f64 {
    let length = step_energies.iter().map(|w| w.max(0.0).sqrt()).sum();
    mutant!(length, LengthOfSum => step_energies.iter().sum::<f64>().sqrt())
}

/// Returns the dissipation `K sum W_k` of a path with these step energies.
pub(crate) fn dissipation(step_energies: &[f64]) -> f64 {
    let count = mutant!(step_energies.len(), DissipationCount => 1);
    count as f64 * step_energies.iter().sum::<f64>()
}
