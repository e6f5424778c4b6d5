//! The mismatch of a shape with a phase field, the least one with any, and the energy of a shape above that.

use crate::energy::Energy;
use crate::error::AverageError;
use crate::level::LevelShapes;
use crate::params::AverageParams;
use fe_grid::composition::{Interpolant, Matching};
use fe_grid::{Assembly, Data, Grid, GridError, compiled_once};
use phasefield::{LeastMismatch, Masked, Mismatch};

compiled_once! {
    /// Computes the mismatch `F[v o phi, v_i]` of a shape of one component, from the average `v`, the phase field
    /// `v_i` and the displacement of `phi`, with the interface width of the parameters. Mismatches of results are
    /// these, where no part of a shape is hidden.
    ///
    /// # Errors
    /// [`AverageError`] where the density is not finite.
    ///
    /// # Panics
    /// If the fields and the displacement do not have one and `D` values per node.
    pub fn mismatch_energy<'a, D>(
        params: &'a AverageParams,
        grid: &'a Grid<D>,
        fields: [&'a [f64]; 2],
        displacement: &'a [f64],
    ) -> Result<f64, AverageError> = mismatch_energy_in;
}

fn mismatch_energy_in<const D: usize>(
    params: &AverageParams,
    grid: &Grid<D>,
    [average, phase_field]: [&[f64]; 2],
    displacement: &[f64],
) -> Result<f64, AverageError> {
    let density = Mismatch {
        interface_width: params.interface_cells * grid.spacing(),
        scale: 1.0,
    };
    let law = Matching::new(density, Interpolant::new(*grid, average));
    let data = Data {
        coefficients: &[phase_field],
        cells: &[],
    };
    Ok(Assembly::new(*grid, &law, data).value(displacement)?)
}

/// Computes the least mismatch of each shape, of all processes, with any phase field. Collective.
pub(crate) fn floors<const D: usize>(shapes: &LevelShapes<D>) -> Result<Vec<f64>, GridError> {
    let grid = *shapes.grid();
    let rest = vec![0.0; D * grid.n_nodes()];
    let density = LeastMismatch {
        interface_width: shapes.interface_width(),
    };
    let of_component = |i: usize, c: usize| {
        let coefficients = shapes.match_coefficients(i, c);
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let field = Interpolant::new(grid, coefficients[0]);
        if shapes.seen().is_empty() {
            Assembly::new(grid, &Matching::new(density, field), data).value(&rest)
        } else {
            Assembly::new(grid, &Matching::new(Masked(density), field), data).value(&rest)
        }
    };
    let components = 0..shapes.n_components();
    let floor = |i: usize| {
        let floors = components.clone().map(|c| of_component(i, c));
        floors.sum::<Result<f64, _>>().map(|f| [f])
    };
    let own: Result<Vec<[f64; 1]>, _> = (0..shapes.n_own()).map(floor).collect();
    let all = shapes.distribution().share(&own?);
    Ok(all.into_flattened())
}

/// Returns the energies `e_i = lambda_i W_i + gamma/n (F_i - min F_i)` of the shapes, given `min F_i`, the
/// weights `lambda_i`, and `gamma/n`: squares of their distances from the average.
pub(crate) fn energies_above(
    floors: &[f64],
    weights: &[f64],
    mismatch_weight: f64,
    energy: &Energy,
) -> Vec<f64> {
    let own = |i: usize| {
        let excess = (energy.mismatch[i] - floors[i]).max(0.0);
        weights[i] * energy.elastic[i] + mismatch_weight * excess
    };
    (0..floors.len()).map(own).collect()
}
