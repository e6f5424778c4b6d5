//! Fixed points by Anderson's acceleration.
//!
//! An equation `r(x) = 0` with an approximate inverse `P` of the derivative of `-r` is the fixed
//! point `f(x) = P r(x) = 0` of `x + f(x)`. The next iterate is made of the last ones,
//!
//! ```text
//! x' = x + f - sum_j g_j (dx_j + df_j),   |f - sum_j g_j df_j| least,
//! ```
//!
//! which for a linear equation is GMRES with the preconditioner `P`: one residual and one cycle an
//! iteration, with no derivative of `r`, which here is not symmetric and has no energy.
//!
//! Source: Walker and Ni, *Anderson acceleration for fixed-point iterations*, SIAM Journal on
//! Numerical Analysis 49 (2011).

use crate::error::GeodesicError;
use fe_grid::minimise::{Control, Evaluations, Iteration, Observer};
use fe_grid::vector::{add_scaled_into, axpy, copy_into, dot, norm, scale};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use std::collections::VecDeque;

/// Differences whose part that is new is below this share do not count.
const DEPENDENT: f64 = 1e-10;
/// A correction that has grown by this factor over the least one was a step too far.
const GROWN: f64 = 5.0;
/// Times that the iteration begins anew from its best state, with shorter steps.
const RESTARTS: usize = 8;
/// Iterations over which the least correction has to fall by half.
const PATIENCE: usize = 25;
/// Halvings of a step that leaves the admissible states.
const HALVINGS: usize = 12;

/// An equation in the form of a correction that vanishes where it holds.
pub(super) trait Correction {
    /// The correction at a state; false where the state is not admissible.
    ///
    /// # Errors
    /// Whatever makes it pointless to go on.
    fn correction_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<bool, GeodesicError>;

    /// Shortens a step where it would leave the admissible states.
    fn restrain(&self, x: &[f64], step: &mut [f64]);
}

/// How an equation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
#[serde(rename_all = "snake_case")]
pub enum SolveStatus {
    /// The correction is as small as asked.
    Converged,
    /// All iterations were used.
    MaxIterations,
    /// No step gets on: the state asked for may not exist, or is folded.
    Stalled,
    /// The observer asked to stop.
    Cancelled,
}

/// When to stop.
pub(super) struct Anderson {
    /// Iterates that are remembered.
    pub history: usize,
    /// Most iterations.
    pub max_iterations: usize,
    /// Norm of the correction that is small enough.
    pub tolerance: f64,
}

/// What was done.
pub(super) struct Solved {
    pub status: SolveStatus,
    pub iterations: usize,
    /// Corrections that were computed.
    pub evaluations: usize,
    /// Norm of the correction at the end.
    pub correction: f64,
}

/// A state and its correction.
#[derive(Clone)]
struct State {
    x: Vec<f64>,
    f: Vec<f64>,
    size: f64,
}

struct Run<'a, C> {
    problem: &'a mut C,
    params: &'a Anderson,
    history: VecDeque<[Vec<f64>; 2]>,
    evaluations: usize,
}

impl Anderson {
    /// Solves for `x`, which is overwritten by the best state found.
    ///
    /// # Errors
    /// Those of the correction.
    pub fn solve<C: Correction>(
        &self,
        problem: &mut C,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Solved, GeodesicError> {
        let mut run = Run {
            problem,
            params: self,
            history: VecDeque::new(),
            evaluations: 0,
        };
        let Some(first) = run.at(x.to_vec())? else {
            return Ok(Solved {
                status: SolveStatus::Stalled,
                iterations: 0,
                evaluations: run.evaluations,
                correction: f64::INFINITY,
            });
        };
        let (best, status, iterations) = run.iterate(first, observer)?;
        copy_into(&best.x, x);
        Ok(Solved {
            status,
            iterations,
            evaluations: run.evaluations,
            correction: best.size,
        })
    }
}

impl<C: Correction> Run<'_, C> {
    fn at(&mut self, x: Vec<f64>) -> Result<Option<State>, GeodesicError> {
        let mut f = vec![0.0; x.len()];
        self.evaluations += 1;
        let admissible = self.problem.correction_into(&x, &mut f)?;
        let size = norm(&f);
        Ok((admissible && size.is_finite()).then_some(State { x, f, size }))
    }

    fn iterate(
        &mut self,
        first: State,
        observer: &mut dyn Observer,
    ) -> Result<(State, SolveStatus, usize), GeodesicError> {
        let (mut best, first_size) = (first.clone(), first.size);
        let mut state = first;
        let (mut length, mut restarts) = (1.0, 0);
        // The least correction so far, where it last had halved, and when.
        let (mut mark, mut marked) = (first_size, 0);
        for iteration in 0..=self.params.max_iterations {
            let seen = observer.iteration(&Iteration {
                iteration,
                energy: state.size,
                gradient_norm: state.size,
                step_length: length,
                evaluations: Evaluations {
                    gradients: self.evaluations,
                    metric_applications: self.evaluations,
                    ..Evaluations::default()
                },
                x: &state.x,
            });
            if state.size <= self.params.tolerance {
                return Ok((state, SolveStatus::Converged, iteration));
            }
            if seen == Control::Cancel {
                return Ok((best, SolveStatus::Cancelled, iteration));
            }
            if iteration == self.params.max_iterations {
                return Ok((best, SolveStatus::MaxIterations, iteration));
            }
            if best.size <= 0.5 * mark {
                (mark, marked) = (best.size, iteration);
            } else if iteration - marked >= PATIENCE {
                return Ok((best, SolveStatus::Stalled, iteration));
            }
            match self.step(&state, length)? {
                Some(next) if next.size <= GROWN * best.size => {
                    self.remember(&state, &next);
                    state = next;
                    if state.size < best.size {
                        best = state.clone();
                    }
                }
                _ => {
                    restarts += 1;
                    if restarts > RESTARTS {
                        return Ok((best, SolveStatus::Stalled, iteration));
                    }
                    self.history.clear();
                    length *= 0.5;
                    state = best.clone();
                }
            }
        }
        Ok((best, SolveStatus::MaxIterations, self.params.max_iterations))
    }

    /// The next state; none where there is no admissible one along the step.
    fn step(&mut self, state: &State, length: f64) -> Result<Option<State>, GeodesicError> {
        let mut step = self.accelerated(&state.f, length);
        self.problem.restrain(&state.x, &mut step);
        for _ in 0..HALVINGS {
            let mut x = vec![0.0; step.len()];
            add_scaled_into(&state.x, 1.0, &step, &mut x);
            if let Some(next) = self.at(x)? {
                return Ok(Some(next));
            }
            scale(0.5, &mut step);
        }
        Ok(None)
    }

    /// The step that the history makes of a correction.
    fn accelerated(&self, f: &[f64], length: f64) -> Vec<f64> {
        let mut step = f.to_vec();
        scale(length, &mut step);
        let n = self.history.len();
        if n == 0 {
            return step;
        }
        // Normal equations of differences of length one; what depends on the others is left out.
        let sizes: Vec<f64> = self.history.iter().map(|[_, df]| norm(df)).collect();
        let gram = DMatrix::from_fn(n, n, |i, j| {
            dot(&self.history[i][1], &self.history[j][1]) / (sizes[i] * sizes[j])
        });
        let right = DVector::from_fn(n, |i, _| dot(&self.history[i][1], f) / sizes[i]);
        let Ok(shares) = gram.svd(true, true).solve(&right, DEPENDENT) else {
            return step;
        };
        for (j, [dx, df]) in self.history.iter().enumerate() {
            let share = shares[j] / sizes[j];
            axpy(-share, dx, &mut step);
            axpy(-share * length, df, &mut step);
        }
        step
    }

    fn remember(&mut self, old: &State, new: &State) {
        let difference = |a: &[f64], b: &[f64]| {
            let mut out = vec![0.0; a.len()];
            add_scaled_into(a, -1.0, b, &mut out);
            out
        };
        let pair = [difference(&new.x, &old.x), difference(&new.f, &old.f)];
        if norm(&pair[1]) > 0.0 {
            self.history.push_back(pair);
        }
        while self.history.len() > self.params.history {
            self.history.pop_front();
        }
    }
}
