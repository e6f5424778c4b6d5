//! Convergence histories.

use serde::{Deserialize, Serialize};

/// One accepted step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct HistoryPoint {
    /// Level, counted from the coarsest.
    pub level: usize,
    /// Nodes per side.
    pub nodes: usize,
    /// Accepted steps on this level so far.
    pub iteration: usize,
    /// Evaluations of the functional on all levels so far.
    pub evaluations: usize,
    /// The energy.
    pub energy: f64,
}
