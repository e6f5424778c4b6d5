//! Stopping criteria and convergence history.

use super::counted::Counted;
use super::info::{Evaluations, Info, Status};
use super::memory::{Ended, Memory};
use super::objective::Objective;
use super::observer::{Control, Iteration, Observer};

/// Stopping criteria of a minimisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stopping {
    /// Stops if `sqrt(g · P g)` in the method's inverse metric is below this fraction of its first
    /// value.
    pub relative_gradient: f64,
    /// Stops if half the slope along the next direction, the predicted decrease, is below this
    /// fraction of [`Objective::energy_scale`](super::Objective::energy_scale). 0: never.
    pub relative_decrement: f64,
    /// Stops if half that slope is below this value, for any energy: if the minimum is zero, energy
    /// and slope finally consist of rounding errors. 0: never.
    pub absolute_decrement: f64,
    /// Stops if the energy decreased by less than this fraction of
    /// [`Objective::energy_scale`](super::Objective::energy_scale) in [`Stopping::energy_window`]
    /// iterations.
    pub relative_energy: f64,
    /// Number of iterations over which the decrease of the energy is measured. 0: it is not
    /// measured.
    pub energy_window: usize,
    /// Maximal number of iterations.
    pub max_iterations: usize,
}

impl Default for Stopping {
    fn default() -> Self {
        Self {
            relative_gradient: 1e-6,
            relative_decrement: 0.0,
            absolute_decrement: 0.0,
            relative_energy: 1e-9,
            energy_window: 5,
            max_iterations: 100,
        }
    }
}

/// Whether the metric is recomputed after so many accepted steps, for an interval between; 0 stands for at the first
/// alone.
pub(super) fn has_new_metric(interval: usize, iterations: usize) -> bool {
    iterations == 0 || interval > 0 && iterations.is_multiple_of(interval)
}

/// Number of energies that are stored without reallocation.
const RESERVED_ENERGIES: usize = 4096;

/// Evaluates the criteria in every iteration, notifies the observer and records the history.
pub(super) struct Monitor<'a> {
    stopping: &'a Stopping,
    observer: &'a mut dyn Observer,
    info: Info,
}

impl<'a> Monitor<'a> {
    pub(super) fn new(stopping: &'a Stopping, observer: &'a mut dyn Observer) -> Self {
        let reserved = RESERVED_ENERGIES.min(stopping.max_iterations + 1);
        let info = Info {
            status: Status::InadmissibleStart,
            iterations: 0,
            evaluations: Evaluations::default(),
            energies: Vec::with_capacity(reserved),
            first_gradient_norm: 0.0,
            gradient_norm: 0.0,
        };
        Self {
            stopping,
            observer,
            info,
        }
    }

    /// Records a state (the first one, or the one after an accepted step) and returns whether to
    /// stop there. `scale` is what relative tolerances refer to, `slope` the derivative of the energy
    /// along the next direction `-P g`.
    pub(super) fn judge(
        &mut self,
        x: &[f64],
        (energy, scale): (f64, f64),
        slope: f64,
        step_length: f64,
        evaluations: Evaluations,
    ) -> Option<Status> {
        let info = &mut self.info;
        info.iterations = info.energies.len();
        info.energies.push(energy);
        info.gradient_norm = slope.abs().sqrt();
        if info.iterations == 0 {
            info.first_gradient_norm = info.gradient_norm;
        }
        let control = self.observer.iteration(&Iteration {
            iteration: info.iterations,
            energy,
            gradient_norm: info.gradient_norm,
            step_length,
            evaluations,
            x,
        });
        if control == Control::Cancel {
            return Some(Status::Cancelled);
        }
        if slope.is_nan() || slope > 0.0 {
            return Some(Status::IndefiniteMetric);
        }
        let share = self.stopping.relative_decrement * scale;
        if -0.5 * slope <= share.max(self.stopping.absolute_decrement) {
            return Some(Status::GradientTolerance);
        }
        let tolerance = self.stopping.relative_gradient * info.first_gradient_norm;
        if info.gradient_norm <= tolerance {
            return Some(Status::GradientTolerance);
        }
        if self.stalled(energy, scale) {
            return Some(Status::EnergyTolerance);
        }
        (self.info.iterations >= self.stopping.max_iterations).then_some(Status::MaxIterations)
    }

    /// Takes over the record of an earlier run.
    pub(super) fn restore(&mut self, memory: &Memory<'_>) {
        self.info.energies.clear();
        self.info.energies.extend_from_slice(&memory.energies);
        self.info.iterations = memory.energies.len() - 1;
        self.info.first_gradient_norm = memory.first_gradient_norm;
    }

    /// Records the slope at the state that an earlier run has judged, from which this one goes on.
    pub(super) fn take_up(&mut self, slope: f64) {
        self.info.gradient_norm = slope.abs().sqrt();
    }

    /// Passes on the memory that `make` returns for a record.
    pub(super) fn remember<'b>(&'b mut self, make: impl FnOnce(&'b [f64], f64) -> Memory<'b>) {
        let memory = make(&self.info.energies, self.info.first_gradient_norm);
        self.observer.memory(&memory);
    }

    /// Passes on the result of a run. One that is cancelled goes on another time.
    pub(super) fn remember_end<O: Objective>(
        &mut self,
        x: &[f64],
        status: Status,
        objective: &Counted<'_, O>,
    ) {
        if matches!(status, Status::Cancelled | Status::InadmissibleStart) {
            return;
        }
        let gradient_norm = self.info.gradient_norm;
        self.remember(|energies, first_gradient_norm| Memory {
            energies: energies.into(),
            first_gradient_norm,
            evaluations: objective.evaluations,
            ended: Some(Ended {
                status,
                gradient_norm,
            }),
            ..Memory::of_result(x, objective.memory())
        });
    }

    /// Whether a memory would be of use now, within the run.
    pub(super) fn remembers(&mut self) -> bool {
        self.observer.remembers(false)
    }

    /// Returns the final record of an earlier run.
    pub(super) fn finish_as(mut self, ended: Ended, evaluations: Evaluations) -> Info {
        self.info.gradient_norm = ended.gradient_norm;
        self.finish(ended.status, evaluations)
    }

    /// Returns the final record.
    pub(super) fn finish(mut self, status: Status, evaluations: Evaluations) -> Info {
        self.info.status = status;
        self.info.evaluations = evaluations;
        self.info
    }

    fn stalled(&self, energy: f64, scale: f64) -> bool {
        let window = self.stopping.energy_window;
        if window == 0 || self.info.iterations < window {
            return false;
        }
        let fall = self.info.energies[self.info.iterations - window] - energy;
        fall <= self.stopping.relative_energy * scale
    }
}
