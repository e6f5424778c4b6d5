//! The finest level in rounds: L-BFGS until the energy falls slowly, an estimate of the energy that
//! remains, and L-BFGS again to a smaller tolerance while the estimate is too large.
//!
//! Five iterations that lower the energy little may be slow iterations far from the minimum: with 3D
//! blobs at 33^3 nodes the elastic energy was then 7 % above its limit. The estimate, from a model of the
//! second derivatives, sees the difference.

use crate::error::AverageError;
use crate::objective::AverageObjective;
use fe_grid::minimise::{
    Control, Info, Iteration, LbfgsParams, Memory, Minimiser, Observer, Status,
};

/// The estimate may be this share of the elastic energy, or twice the tolerance if that is more. An
/// estimate far below it is uncertain: discrete mismatches have jumps of up to a thousandth.
const ENOUGH: f64 = 0.01;
/// Most rounds. Where folds of the void hold the deformations back, more do not help.
const MOST: usize = 3;

/// Minimises in rounds. The status is that of the first round, unless a later one converged, too, or was
/// cancelled.
pub(crate) fn minimise_in_rounds<const D: usize>(
    params: &LbfgsParams,
    objective: &mut AverageObjective<D>,
    x: &mut [f64],
    observer: &mut dyn Observer,
) -> Result<Info, AverageError> {
    let resumed = observer.resume();
    if let Some(memory) = resumed.as_ref().filter(|memory| memory.x.len() == x.len()) {
        objective.recall(&memory.objective);
    }
    let mut view = View {
        observer,
        resumed,
        offset: 0,
    };
    loop {
        let done = objective.rounds.energies.len().saturating_sub(1);
        view.offset = done;
        let mut round = *params;
        round.stopping.max_iterations = params.stopping.max_iterations.saturating_sub(done);
        let found = round.minimise(objective, x, &mut view)?;
        let status = found.status;
        let first = objective.rounds.count == 0;
        let mut info = objective.rounds.append(&found);
        if !first && matches!(status, Status::MaxIterations | Status::LineSearchFailed) {
            info.status = Status::EnergyTolerance;
        }
        if matches!(status, Status::Cancelled | Status::InadmissibleStart) {
            return Ok(info);
        }
        let share = ENOUGH.max(2.0 * params.stopping.relative_energy);
        let last = !status.converged() || objective.rounds.count == MOST;
        objective.found_remaining = objective.remaining(x, share, !last)?;
        let limit = share * objective.elastic_scale();
        let enough = objective.found_remaining.is_none_or(|left| left <= limit);
        if enough || last {
            return Ok(info);
        }
    }
}

/// One observer for all rounds of a level.
pub(crate) struct View<'a> {
    pub observer: &'a mut dyn Observer,
    /// What the next run resumes from.
    pub resumed: Option<Memory<'static>>,
    /// Iterations of earlier rounds.
    pub offset: usize,
}

impl Observer for View<'_> {
    fn level(&mut self, level: usize, n_levels: usize, dim: usize) {
        self.observer.level(level, n_levels, dim);
    }

    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        if self.offset > 0 && iteration.iteration == 0 {
            return self.observer.between();
        }
        self.observer.iteration(&Iteration {
            iteration: self.offset + iteration.iteration,
            ..*iteration
        })
    }

    fn resume(&mut self) -> Option<Memory<'static>> {
        self.resumed.take()
    }

    fn memory(&mut self, memory: &Memory<'_>) {
        self.observer.memory(memory);
    }

    fn remembers(&mut self, ended: bool) -> bool {
        self.observer.remembers(ended)
    }

    fn between(&mut self) -> Control {
        self.observer.between()
    }
}
