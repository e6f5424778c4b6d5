//! Minimisation on a level, for both forms.

use crate::params::GeodesicParams;
use fe_grid::minimise::{LbfgsParams, Stopping};
use fe_grid::{Grid, certify_within};
use hyperelastic::FoldBarrier;

/// Number of pairs in the L-BFGS history.
const HISTORY: usize = 10;
/// Number of iterations after which the metric is recomputed.
const METRIC_INTERVAL: usize = 10;
/// A level ends when the predicted decrease is below this fraction of the tolerance.
const DECREMENT: f64 = 0.1;
/// Number of iterations over which the decrease of the energy is measured.
const ENERGY_WINDOW: usize = 5;
/// Number of interpolations towards the identity tried where a deformation is not admissible.
const REPAIRS: usize = 40;

/// The barrier acts at corners whose determinant is below this value.
const BARRIER_ONSET: f64 = 0.2;
/// Decrease that is due to rounding, per weight of the match: for equal shapes the match is a sum
/// of squares of differences of the order of the machine precision.
const NOTHING: f64 = 1e-24;

/// Returns the barrier that prevents the corners of cells from folding where the void is too soft.
/// Its weight is proportional to that of the match, whose forces it must balance: without it paths
/// end at the bound of the determinant, where no descent direction is left.
pub(crate) fn fold_barrier(params: &GeodesicParams) -> FoldBarrier {
    FoldBarrier {
        weight: params.void_stiffness * params.resolved_match_weight(),
        onset: BARRIER_ONSET,
    }
}

/// Returns the minimiser of a level.
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

/// Interpolates a displacement towards the identity until its determinant exceeds a bound on the
/// cells marked by `solid`, or on all cells.
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
