//! Progress reports and cancellation of a minimisation.

use super::info::Evaluations;
use super::memory::Memory;

/// Whether to continue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Continue.
    Continue,
    /// Stop at the present state.
    Cancel,
}

/// The state of a minimisation.
#[derive(Clone, Copy, Debug)]
pub struct Iteration<'a> {
    /// Number of accepted steps so far; 0 at the start.
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

/// An observer of a minimisation.
pub trait Observer {
    /// Called at the start of a level of a multilevel minimisation: `level` of `n_levels`, counted
    /// from the coarsest, with `dim` unknowns.
    fn level(&mut self, level: usize, n_levels: usize, dim: usize) {
        let _ = (level, n_levels, dim);
    }

    /// Called at the start and after every accepted step.
    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        let _ = iteration;
        Control::Continue
    }

    /// Called by solvers that can resume, at the start of each run: the memory to resume from, if there
    /// is one. One that does not fit the run is ignored.
    fn resume(&mut self) -> Option<Memory<'static>> {
        None
    }

    /// Called by solvers that can resume, after iterations from which they can, and at the end.
    fn memory(&mut self, memory: &Memory<'_>) {
        let _ = memory;
    }

    /// Whether [`Observer::memory`] would be of use now, within a run or at its end. Asked only where a
    /// memory has to be collected from several processes or converted first; the default says no.
    fn remembers(&mut self, ended: bool) -> bool {
        let _ = ended;
        false
    }

    /// Called in work without iterations of a minimiser; returns whether to continue.
    fn between(&mut self) -> Control {
        Control::Continue
    }
}

/// An observer that does nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {}
