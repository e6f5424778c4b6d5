//! Progress of a minimisation, and the wish to stop it.

use super::info::Evaluations;

/// Whether to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    Continue,
    /// Stop at the state that has been reached.
    Cancel,
}

/// The state of a minimisation.
#[derive(Clone, Copy, Debug)]
pub struct Iteration<'a> {
    /// Accepted steps so far; 0 at the start.
    pub iteration: usize,
    /// The energy.
    pub energy: f64,
    /// `sqrt(g · P g)` in the method's inverse metric.
    pub gradient_norm: f64,
    /// Factor of the last step; 0 at the start.
    pub step_length: f64,
    /// Work done so far.
    pub evaluations: Evaluations,
    /// The state, for a checkpoint.
    pub x: &'a [f64],
}

/// Somebody who watches a minimisation.
pub trait Observer {
    /// A level of a multilevel minimisation begins: `level` of `n_levels`, counted from the
    /// coarsest, with `dim` unknowns.
    fn level(&mut self, level: usize, n_levels: usize, dim: usize) {
        let _ = (level, n_levels, dim);
    }

    /// At the start and after every accepted step.
    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        let _ = iteration;
        Control::Continue
    }

    /// In work that has no iterations of a minimiser: whether to go on.
    fn between(&mut self) -> Control {
        Control::Continue
    }
}

/// Nobody watches.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {}
