//! The minimiser of a level and the barrier, for both forms.

use crate::params::GeodesicParams;
use fe_grid::minimise::{LbfgsParams, Stopping};
use hyperelastic::FoldBarrier;

/// Number of pairs in the L-BFGS history.
pub(crate) const HISTORY: usize = 10;
/// Number of iterations after which the metric is recomputed.
const METRIC_INTERVAL: usize = 10;
/// A level ends when the predicted decrease is below this fraction of the tolerance.
const DECREMENT: f64 = 0.1;
/// Decrease that is due to rounding, per weight of the mismatch: for equal shapes the mismatch is a
/// sum of squares of differences of the order of the machine precision.
const NOTHING: f64 = 1e-24;

/// Returns the barrier that prevents the corners of cells from folding where the void is too soft.
/// Its weight is proportional to that of the mismatch, whose forces it must balance: without it
/// paths end at the bound of the determinant, where no descent direction is left.
pub(crate) fn fold_barrier(params: &GeodesicParams) -> FoldBarrier {
    FoldBarrier {
        weight: params.void_stiffness * params.resolved_mismatch_weight(),
        onset: FoldBarrier::ONSET,
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
            absolute_decrement: NOTHING * params.resolved_mismatch_weight(),
            relative_energy: params.tolerance,
            max_iterations: params.resolved_max_iterations(),
            ..Stopping::default()
        },
        ..LbfgsParams::default()
    }
}
