//! The interface between a minimiser and a problem.

use super::info::Info;
use super::observer::Observer;
use crate::buffer::Buffer;
use crate::distribution::Distribution;
use crate::lane::{Element, Stored};
use crate::vector::{change_in_double, in_double};

/// The outcome of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Evaluation {
    /// The energy.
    Value(f64),
    /// The energy at this state is not finite; a line search continues with a shorter step.
    Inadmissible,
}

impl Evaluation {
    /// Returns the energy, unless the state is inadmissible.
    pub fn energy(self) -> Option<f64> {
        match self {
            Self::Value(energy) => Some(energy),
            Self::Inadmissible => None,
        }
    }
}

/// An energy of `dim` unknowns with a gradient and a metric.
pub trait Objective {
    /// Error other than an inadmissible state, such as a linear solver that breaks down.
    type Error;

    /// Returns the number of unknowns.
    fn dim(&self) -> usize;

    /// Returns the distribution of the unknowns to processes. Minimisers take scalar products by it:
    /// part by part. The default is one part on one process. With several processes all functions are
    /// collective, `dim` and all vectors are those of this process, and energies are those of all.
    fn distribution(&self) -> Distribution {
        Distribution::alone(1)
    }

    /// Computes the energy at `x` and its gradient, which overwrites `gradient` (and is undefined
    /// if the state is inadmissible).
    ///
    /// # Errors
    /// Any error that prevents the minimisation from continuing.
    fn value_and_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, Self::Error>;

    /// Computes the energy alone, if that is cheaper. The default implementation allocates a
    /// gradient in every call.
    ///
    /// # Errors
    /// Any error that prevents the minimisation from continuing.
    fn value(&mut self, x: &[f64]) -> Result<Evaluation, Self::Error> {
        let mut gradient = vec![0.0; self.dim()];
        self.value_and_gradient(x, &mut gradient)
    }

    /// Returns the energy that relative tolerances refer to, positive, given the energy of the state that
    /// was evaluated last. The default is that energy itself. An objective with a large part that no
    /// state can lose returns the rest.
    fn energy_scale(&self, energy: f64) -> f64 {
        energy.abs()
    }

    /// Computes `out = P gradient` with a fixed, symmetric and positive definite `P`, ideally close
    /// to the inverse Hessian. The default is the identity.
    ///
    /// # Errors
    /// Any error that prevents the minimisation from continuing.
    fn apply_inverse_metric(
        &mut self,
        gradient: &[f64],
        out: &mut [f64],
    ) -> Result<(), Self::Error> {
        crate::vector::copy_into(gradient, out);
        Ok(())
    }

    /// Shortens the parts of a direction that would leave the admissible states, so that
    /// `x + direction` is admissible if possible. The other parts of the direction are not changed:
    /// a blocked part does not affect the others. The default does nothing.
    ///
    /// # Errors
    /// Any error that prevents the minimisation from continuing.
    fn restrain(&mut self, x: &[f64], direction: &mut [f64]) -> Result<(), Self::Error> {
        let _ = (x, direction);
        Ok(())
    }

    /// [`Objective::value_and_gradient`] with a gradient in either precision. The default converts the whole
    /// vector, as do those of the next methods; an objective of many parts converts one part at a time.
    ///
    /// # Errors
    /// Any error that prevents the minimisation from continuing.
    fn value_and_gradient_in<T: Element>(
        &mut self,
        x: &[f64],
        gradient: &mut [T],
    ) -> Result<Evaluation, Self::Error>
    where
        Self: Sized,
    {
        change_in_double(gradient, |gradient| self.value_and_gradient(x, gradient))
    }

    /// [`Objective::apply_inverse_metric`] in either precision.
    ///
    /// # Errors
    /// Any error that prevents the minimisation from continuing.
    fn apply_inverse_metric_in<T: Element>(
        &mut self,
        gradient: &[T],
        out: &mut [T],
    ) -> Result<(), Self::Error>
    where
        Self: Sized,
    {
        let gradient = in_double(gradient);
        change_in_double(out, |out| self.apply_inverse_metric(&gradient, out))
    }

    /// [`Objective::restrain`] with a direction in either precision.
    ///
    /// # Errors
    /// Any error that prevents the minimisation from continuing.
    fn restrain_in<T: Element>(&mut self, x: &[f64], direction: &mut [T]) -> Result<(), Self::Error>
    where
        Self: Sized,
    {
        change_in_double(direction, |direction| self.restrain(x, direction))
    }

    /// Allocates a vector of the minimiser, filled with zeros: in memory, unless the objective
    /// provides other storage.
    ///
    /// # Errors
    /// If the allocation fails.
    fn room<T: Stored>(&self, len: usize) -> Result<Buffer<T>, Self::Error>
    where
        Self: Sized,
    {
        Ok(Buffer::zeros(len))
    }

    /// Returns what evaluations leave behind for later ones, such as initial guesses and counters;
    /// the metric is not part of it. The default is nothing.
    fn memory(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Takes over what [`Objective::memory`] has returned.
    fn restore(&mut self, memory: &[f64]) {
        let _ = memory;
    }

    /// Recomputes `P` for the state `x`. It is not changed until the next call.
    ///
    /// # Errors
    /// Any error that prevents the minimisation from continuing.
    fn update_metric(&mut self, x: &[f64]) -> Result<(), Self::Error> {
        let _ = x;
        Ok(())
    }
}

/// An objective with second derivatives.
pub trait SecondOrder: Objective {
    /// Computes `out = H(x) direction`, or a symmetric approximation of it. It is called only at
    /// the last state whose gradient was accepted.
    ///
    /// # Errors
    /// Any error that prevents the minimisation from continuing.
    fn hessian_action(
        &mut self,
        x: &[f64],
        direction: &[f64],
        out: &mut [f64],
    ) -> Result<(), Self::Error>;

    /// [`SecondOrder::hessian_action`] with vectors in either precision. The default converts them.
    ///
    /// # Errors
    /// Any error that prevents the minimisation from continuing.
    fn hessian_action_in<T: Element>(
        &mut self,
        x: &[f64],
        direction: &[T],
        out: &mut [T],
    ) -> Result<(), Self::Error>
    where
        Self: Sized,
    {
        let direction = in_double(direction);
        change_in_double(out, |out| self.hessian_action(x, &direction, out))
    }
}

/// A method of minimisation.
pub trait Minimiser<O: Objective> {
    /// Minimises the energy from the state `x`, which is overwritten by the best state found.
    /// Failure to converge is not an error; it is reported in [`Info::status`].
    ///
    /// # Errors
    /// Those of the objective; `x` is then the last accepted state.
    ///
    /// # Panics
    /// If `x` does not have the dimension of the objective.
    fn minimise(
        &self,
        objective: &mut O,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Info, O::Error>;
}
