//! The least mismatch of a shape with any phase field, and the energy of a shape above it.

use crate::energy::Energy;
use crate::level::LevelShapes;
use fe_grid::composition::{Interpolant, Matching};
use fe_grid::{Assembly, Data, GridError};
use phasefield::{LeastMismatch, Masked};

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
