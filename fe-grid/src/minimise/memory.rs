//! What a minimiser remembers between two iterations, to go on from there to the same bits.

use std::borrow::Cow;

use super::info::Evaluations;

/// The memory of L-BFGS after an iteration in which the metric has been recomputed. With the same
/// objective and parameters, a run that resumes from it gives the bits of the run that it is from.
#[derive(Clone, Debug, PartialEq)]
pub struct Memory<'a> {
    /// The state.
    pub x: Cow<'a, [f64]>,
    /// The gradient there.
    pub gradient: Cow<'a, [f64]>,
    /// The pairs, oldest first.
    pub pairs: Vec<MemoryPair<'a>>,
    /// The energies so far; the last is that of the state.
    pub energies: Cow<'a, [f64]>,
    /// Size of the gradient at the start.
    pub first_gradient_norm: f64,
    /// Factor of the last step.
    pub step_length: f64,
    /// Work so far.
    pub evaluations: Evaluations,
    /// What the objective remembers of earlier evaluations.
    pub objective: Cow<'a, [f64]>,
}

/// A step and the change of the gradient along it, both scaled.
#[derive(Clone, Debug, PartialEq)]
pub struct MemoryPair<'a> {
    /// The step.
    pub step: Cow<'a, [f32]>,
    /// The change of the gradient.
    pub change: Cow<'a, [f32]>,
    /// The inverse of their scalar product.
    pub inverse_curvature: f64,
    /// The size of the step over the size of the change.
    pub ratio: f64,
}

impl Memory<'_> {
    /// A copy of its own.
    pub fn into_owned(self) -> Memory<'static> {
        let own = |pair: MemoryPair<'_>| MemoryPair {
            step: pair.step.into_owned().into(),
            change: pair.change.into_owned().into(),
            inverse_curvature: pair.inverse_curvature,
            ratio: pair.ratio,
        };
        Memory {
            x: self.x.into_owned().into(),
            gradient: self.gradient.into_owned().into(),
            pairs: self.pairs.into_iter().map(own).collect(),
            energies: self.energies.into_owned().into(),
            first_gradient_norm: self.first_gradient_norm,
            step_length: self.step_length,
            evaluations: self.evaluations,
            objective: self.objective.into_owned().into(),
        }
    }

    /// Whether it is that of a run with this number of unknowns and of at most so many pairs.
    pub(super) fn fits(&self, dim: usize, pairs: usize) -> bool {
        let fits = |pair: &MemoryPair<'_>| pair.step.len() == dim && pair.change.len() == dim;
        self.x.len() == dim
            && self.gradient.len() == dim
            && self.pairs.len() <= pairs
            && self.pairs.iter().all(fits)
            && !self.energies.is_empty()
    }
}
