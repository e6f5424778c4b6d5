//! What a minimiser asks of a problem.

use super::info::Info;
use super::observer::Observer;
use crate::buffer::Buffer;
use crate::lane::Element;

/// The outcome of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Evaluation {
    /// The energy.
    Value(f64),
    /// There is no finite energy at this state; a line search goes on with a shorter step.
    Inadmissible,
}

/// An energy of `dim` numbers with a gradient and a metric.
pub trait Objective {
    /// What can go wrong beside an inadmissible state, such as a linear solver that breaks down.
    type Error;

    /// Number of unknowns.
    fn dim(&self) -> usize;

    /// The energy at `x`, and its derivatives by every unknown, which overwrite `gradient` (and
    /// mean nothing where the state is inadmissible).
    ///
    /// # Errors
    /// Whatever makes it pointless to go on.
    fn value_and_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, Self::Error>;

    /// The energy alone, where that is cheaper. Without an implementation of its own it takes
    /// room for a gradient in every call.
    ///
    /// # Errors
    /// Whatever makes it pointless to go on.
    fn value(&mut self, x: &[f64]) -> Result<Evaluation, Self::Error> {
        let mut gradient = vec![0.0; self.dim()];
        self.value_and_gradient(x, &mut gradient)
    }

    /// `out = P gradient` with a fixed, symmetric and positive definite `P`, close to the inverse
    /// Hessian where there is one to be had. The default is the identity.
    ///
    /// # Errors
    /// Whatever makes it pointless to go on.
    fn apply_inverse_metric(
        &mut self,
        gradient: &[f64],
        out: &mut [f64],
    ) -> Result<(), Self::Error> {
        crate::vector::copy_into(gradient, out);
        Ok(())
    }

    /// Shortens the parts of a direction that would leave the admissible states, so that
    /// `x + direction` is admissible where possible. The rest of the direction stays as it is:
    /// one part that is stuck does not hold up the others. The default does nothing.
    ///
    /// # Errors
    /// Whatever makes it pointless to go on.
    fn restrain(&mut self, x: &[f64], direction: &mut [f64]) -> Result<(), Self::Error> {
        let _ = (x, direction);
        Ok(())
    }

    /// Room for a vector of the minimiser, filled with zeros: in memory, unless the objective
    /// knows a better place.
    ///
    /// # Errors
    /// Where there is no room.
    fn room<T: Element>(&self, len: usize) -> Result<Buffer<T>, Self::Error>
    where
        Self: Sized,
    {
        Ok(Buffer::zeros(len))
    }

    /// Makes `P` anew for the state `x`. It stays as it is until the next call.
    ///
    /// # Errors
    /// Whatever makes it pointless to go on.
    fn update_metric(&mut self, x: &[f64]) -> Result<(), Self::Error> {
        let _ = x;
        Ok(())
    }
}

/// An objective with second derivatives.
pub trait SecondOrder: Objective {
    /// `out = H(x) direction`, or a symmetric approximation of it. It is asked for only at the
    /// last state whose gradient was accepted.
    ///
    /// # Errors
    /// Whatever makes it pointless to go on.
    fn hessian_action(
        &mut self,
        x: &[f64],
        direction: &[f64],
        out: &mut [f64],
    ) -> Result<(), Self::Error>;
}

/// A method of minimisation.
pub trait Minimiser<O: Objective> {
    /// Lowers the energy from the state `x`, which is overwritten by the best state found. Not to
    /// converge is not an error: [`Info::status`] says so.
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
