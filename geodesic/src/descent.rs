//! How both forms are lowered on a level.

use crate::params::GeodesicParams;
use fe_grid::minimise::{LbfgsParams, Stopping};
use fe_grid::{Grid, certify_within};
use hyperelastic::FoldBarrier;

/// Pairs of the L-BFGS memory.
const HISTORY: usize = 10;
/// Iterations after which the metric is made anew.
const METRIC_INTERVAL: usize = 10;
/// A direction that promises less than this share of the tolerance ends a level.
const DECREMENT: f64 = 0.1;
/// Iterations over which the fall of the energy is judged.
const ENERGY_WINDOW: usize = 5;
/// Blends to the identity that are tried where a deformation is not admissible.
const REPAIRS: usize = 40;

/// The barrier is felt by corners whose determinant is below this.
const BARRIER_ONSET: f64 = 0.2;
/// A gain that is rounding, per weight of the match: what equal shapes leave of a match is a sum of
/// squares of differences of the order of the machine precision.
const NOTHING: f64 = 1e-24;

/// What keeps the corners of cells from folding in a void so soft that nothing else does. It grows
/// with the match, whose forces it has to stand: without it paths end on the bound of the
/// determinant, where no direction is left.
pub(crate) fn fold_barrier(params: &GeodesicParams) -> FoldBarrier {
    FoldBarrier {
        weight: params.void_stiffness * params.resolved_match_weight(),
        onset: BARRIER_ONSET,
    }
}

/// The minimiser of a level.
pub(crate) fn minimiser(params: &GeodesicParams) -> LbfgsParams {
    LbfgsParams {
        metric_interval: METRIC_INTERVAL,
        history: HISTORY,
        stopping: Stopping {
            relative_gradient: 0.0,
            relative_decrement: DECREMENT * params.tolerance,
            absolute_decrement: NOTHING * params.resolved_match_weight(),
            relative_energy: params.tolerance,
            energy_window: ENERGY_WINDOW,
            energy_floor: 0.0,
            least_excess: 0.0,
            max_iterations: params.max_iterations,
        },
        ..LbfgsParams::default()
    }
}

/// Draws a displacement to the identity until its determinant exceeds a bound on the cells that
/// `solid` marks, or on all.
pub(crate) fn repair<const D: usize>(
    grid: &Grid<D>,
    displacement: &mut [f64],
    bound: f64,
    solid: Option<&[bool]>,
) {
    for _ in 0..REPAIRS {
        if certify_within(grid, displacement, bound, bound, solid).certified {
            return;
        }
        for u in &mut *displacement {
            *u *= 0.9;
        }
    }
    displacement.fill(0.0);
}
