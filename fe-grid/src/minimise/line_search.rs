//! Backtracking along a direction of descent.

use super::counted::Counted;
use super::objective::{Evaluation, Objective};
use crate::lane::Element;
use crate::vector::add_scaled_into;

/// Armijo's rule with backtracking by a parabola.
///
/// A step `t` along a direction of slope `s < 0` is taken where `E(x + t d) <= E(x) + armijo t s`.
/// Otherwise the minimum of the parabola through `E(x)`, `s` and `E(x + t d)`, kept between the
/// two shares of `t`, is tried next. Where the trial state is inadmissible the step is halved.
///
/// Source: Armijo, *Minimization of functions having Lipschitz continuous first partial
/// derivatives* (1966).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineSearch {
    /// Share of the fall along the tangent that a step must bring.
    pub armijo: f64,
    /// Least share of a failed step that is tried next.
    pub min_shrink: f64,
    /// Largest share of a failed step that is tried next.
    pub max_shrink: f64,
    /// Most states that are tried along one direction.
    pub max_trials: usize,
}

impl Default for LineSearch {
    fn default() -> Self {
        Self {
            armijo: 1e-4,
            min_shrink: 0.1,
            max_shrink: 0.5,
            max_trials: 30,
        }
    }
}

/// Where a line search begins.
pub(super) struct Start<'a, S, T> {
    pub(super) x: &'a [S],
    pub(super) energy: f64,
    pub(super) direction: &'a [T],
    pub(super) slope: f64,
    pub(super) step_length: f64,
}

/// A step that was accepted.
#[derive(Clone, Copy)]
pub(super) struct Step {
    pub(super) length: f64,
    pub(super) energy: f64,
}

impl LineSearch {
    /// Looks for a step; `trial` and `gradient` then hold the new state and its gradient. States are rounded
    /// to the precision of the first.
    ///
    /// The first trial is expected to succeed and so is evaluated with its gradient; later ones
    /// get theirs once the energy alone would do.
    pub(super) fn search<O: Objective, S: Element, T: Element>(
        &self,
        objective: &mut Counted<'_, O>,
        start: &Start<'_, S, T>,
        trial: &mut [f64],
        gradient: &mut [T],
    ) -> Result<Option<Step>, O::Error> {
        let mut length = start.step_length;
        for trial_idx in 0..self.max_trials {
            add_scaled_into(start.x, length, start.direction, trial);
            let mut evaluation = Evaluation::Inadmissible;
            if trial_idx > 0 {
                evaluation = objective.value(trial)?;
            }
            if trial_idx == 0 || self.accepts(start, length, evaluation) {
                evaluation = objective.value_and_gradient(trial, gradient)?;
            }
            match evaluation {
                Evaluation::Value(energy) if self.accepts(start, length, evaluation) => {
                    return Ok(Some(Step { length, energy }));
                }
                Evaluation::Value(energy) => length *= self.shrink(start, length, energy),
                Evaluation::Inadmissible => length *= 0.5,
            }
        }
        Ok(None)
    }

    fn accepts<S, T>(&self, start: &Start<'_, S, T>, length: f64, evaluation: Evaluation) -> bool {
        let bound = start.energy + self.armijo * length * start.slope;
        // Near a minimum the bound rounds to the energy itself: the step must lower it still.
        matches!(evaluation, Evaluation::Value(e) if e <= bound && e < start.energy)
    }

    /// The share of the step at which the parabola is lowest.
    fn shrink<S, T>(&self, start: &Start<'_, S, T>, length: f64, energy: f64) -> f64 {
        let tangent = length * start.slope;
        let excess = energy - start.energy - tangent;
        let share = -0.5 * tangent / excess;
        if share.is_nan() {
            return self.max_shrink;
        }
        share.max(self.min_shrink).min(self.max_shrink)
    }
}
