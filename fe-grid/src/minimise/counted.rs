//! An objective with a tally of its calls.

use super::info::Evaluations;
use super::objective::{Evaluation, Objective, SecondOrder};
use crate::buffer::Buffer;
use crate::distribution::Distribution;
use crate::lane::{Element, Stored};
use crate::vector::scale;

/// Passes calls on and counts them; an energy that is not finite becomes an inadmissible state.
pub(super) struct Counted<'a, O: Objective> {
    objective: &'a mut O,
    distribution: Distribution,
    pub(super) evaluations: Evaluations,
}

impl<'a, O: Objective> Counted<'a, O> {
    pub(super) fn new(objective: &'a mut O) -> Self {
        Self {
            distribution: objective.distribution(),
            objective,
            evaluations: Evaluations::default(),
        }
    }

    pub(super) fn objective(&self) -> &O {
        self.objective
    }

    /// The distribution of the unknowns, which scalar products are taken by.
    pub(super) fn distribution(&self) -> &Distribution {
        &self.distribution
    }

    pub(super) fn room<T: Stored>(&self, len: usize) -> Result<Buffer<T>, O::Error> {
        self.objective.room(len)
    }

    pub(super) fn value(&mut self, x: &[f64]) -> Result<Evaluation, O::Error> {
        self.evaluations.values += 1;
        Ok(finite(self.objective.value(x)?))
    }

    pub(super) fn value_and_gradient<T: Element>(
        &mut self,
        x: &[f64],
        gradient: &mut [T],
    ) -> Result<Evaluation, O::Error> {
        self.evaluations.gradients += 1;
        Ok(finite(self.objective.value_and_gradient_in(x, gradient)?))
    }

    pub(super) fn apply_inverse_metric<T: Element>(
        &mut self,
        gradient: &[T],
        out: &mut [T],
    ) -> Result<(), O::Error> {
        self.evaluations.metric_applications += 1;
        self.objective.apply_inverse_metric_in(gradient, out)
    }

    /// The energy with the scale of relative tolerances.
    pub(super) fn scaled(&self, energy: f64) -> (f64, f64) {
        (energy, self.objective.energy_scale(energy))
    }

    pub(super) fn memory(&self) -> Vec<f64> {
        self.objective.memory()
    }

    pub(super) fn restore(&mut self, memory: &[f64]) {
        self.objective.restore(memory);
    }

    pub(super) fn update_metric(&mut self, x: &[f64]) -> Result<(), O::Error> {
        self.evaluations.metric_builds += 1;
        self.objective.update_metric(x)
    }

    /// Keeps `x + direction` admissible; returns the slope of the energy along the restrained
    /// direction.
    pub(super) fn restrain<T: Element>(
        &mut self,
        x: &[f64],
        gradient: &[T],
        direction: &mut [T],
    ) -> Result<f64, O::Error> {
        self.objective.restrain_in(x, direction)?;
        Ok(self.distribution.dot(gradient, direction))
    }

    /// `direction = -P gradient`; returns the slope of the energy along it.
    pub(super) fn steepest_descent<T: Element>(
        &mut self,
        gradient: &[T],
        direction: &mut [T],
    ) -> Result<f64, O::Error> {
        self.apply_inverse_metric(gradient, direction)?;
        scale(-1.0, direction);
        Ok(self.distribution.dot(gradient, direction))
    }
}

impl<O: SecondOrder> Counted<'_, O> {
    pub(super) fn hessian_action<T: Element>(
        &mut self,
        x: &[f64],
        direction: &[T],
        out: &mut [T],
    ) -> Result<(), O::Error> {
        self.evaluations.hessian_actions += 1;
        self.objective.hessian_action_in(x, direction, out)
    }
}

fn finite(evaluation: Evaluation) -> Evaluation {
    match evaluation {
        Evaluation::Value(energy) if energy.is_finite() => evaluation,
        _ => Evaluation::Inadmissible,
    }
}
