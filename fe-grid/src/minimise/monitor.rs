//! When to stop, and the record that is kept on the way.

use super::info::{Evaluations, Info, Status};
use super::observer::{Control, Iteration, Observer};

/// When a minimisation stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stopping {
    /// Stop where `sqrt(g · P g)` in the method's inverse metric is this share of its first value.
    pub relative_gradient: f64,
    /// Ends when half the slope along the next direction, which is what the direction promises to
    /// gain, is below this share of `|E - energy_floor|`. 0: never.
    pub relative_decrement: f64,
    /// Ends when half that slope is below this, whatever the energy: where a minimum is zero, all
    /// that is left of energy and slope is rounding. 0: never.
    pub absolute_decrement: f64,
    /// Stop where the energy fell by less than this share of its excess over
    /// [`Stopping::energy_floor`] in [`Stopping::energy_window`] iterations.
    pub relative_energy: f64,
    /// Iterations over which the fall of the energy is judged. 0: it is not.
    pub energy_window: usize,
    /// A part of the energy that no state is without; only the rest counts in
    /// [`Stopping::relative_energy`] and [`Stopping::relative_decrement`], or what
    /// [`Stopping::least_excess`] makes of it.
    pub energy_floor: f64,
    /// The excess over the floor counts as at least this share of the energy, for floors that are
    /// estimates.
    pub least_excess: f64,
    /// Most iterations.
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
            energy_floor: 0.0,
            least_excess: 0.0,
            max_iterations: 100,
        }
    }
}

/// Energies that are kept without growing their list.
const RESERVED_ENERGIES: usize = 4096;

/// Judges every iteration, tells the observer and keeps the record.
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

    /// Takes note of a state (the first one, or the one after an accepted step) and says whether
    /// to stop there. `slope` is the derivative of the energy along the next direction `-P g`.
    pub(super) fn judge(
        &mut self,
        x: &[f64],
        energy: f64,
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
        let share = self.stopping.relative_decrement * excess(self.stopping, energy);
        if -0.5 * slope <= share.max(self.stopping.absolute_decrement) {
            return Some(Status::GradientTolerance);
        }
        let tolerance = self.stopping.relative_gradient * info.first_gradient_norm;
        if info.gradient_norm <= tolerance {
            return Some(Status::GradientTolerance);
        }
        if self.stalled(energy) {
            return Some(Status::EnergyTolerance);
        }
        (self.info.iterations >= self.stopping.max_iterations).then_some(Status::MaxIterations)
    }

    /// The record, at the end.
    pub(super) fn finish(mut self, status: Status, evaluations: Evaluations) -> Info {
        self.info.status = status;
        self.info.evaluations = evaluations;
        self.info
    }

    fn stalled(&self, energy: f64) -> bool {
        let window = self.stopping.energy_window;
        if window == 0 || self.info.iterations < window {
            return false;
        }
        let fall = self.info.energies[self.info.iterations - window] - energy;
        fall <= self.stopping.relative_energy * excess(self.stopping, energy)
    }
}

/// What falls of the energy are judged by.
fn excess(stopping: &Stopping, energy: f64) -> f64 {
    let above = (energy - stopping.energy_floor).abs();
    above.max(stopping.least_excess * energy.abs())
}
