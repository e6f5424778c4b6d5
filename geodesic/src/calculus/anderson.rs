//! Anderson acceleration of fixed-point iterations.
//!
//! An equation `r(x) = 0` with an approximate inverse `P` of the derivative of `-r` is the fixed
//! point of `x + f(x)` with `f(x) = P r(x)`. The next iterate is a combination of the last ones,
//!
//! ```text
//! x' = x + f - sum_j g_j (dx_j + df_j),   |f - sum_j g_j df_j| least,
//! ```
//!
//! where the `g_j` minimise the norm on the right. For a linear equation this is GMRES with the
//! preconditioner `P`. Each iteration needs one residual and one application of `P`, and no
//! derivative of `r`, which here is not symmetric and not a gradient.
//!
//! Source: Walker and Ni, *Anderson acceleration for fixed-point iterations*, SIAM Journal on
//! Numerical Analysis 49 (2011).

use crate::error::GeodesicError;
use fe_grid::minimise::{Control, Evaluations, Iteration, Memory, Observer};
use fe_grid::vector::{add_scaled_into, axpy, copy_into, dot, norm, scale};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use std::collections::VecDeque;

/// Differences whose component orthogonal to the others is below this fraction are dropped.
const DEPENDENT: f64 = 1e-10;
/// A step is rejected if the correction exceeds the smallest one so far by this factor.
const GROWN: f64 = 5.0;
/// Maximal number of restarts from the best state, with shorter steps.
const RESTARTS: usize = 8;
/// Number of iterations within which the smallest correction has to be halved.
const PATIENCE: usize = 25;
/// Maximal number of halvings of a step that leaves the admissible states.
const HALVINGS: usize = 12;

/// An equation in the form of a correction that vanishes at the solution.
pub(super) trait Correction {
    /// Computes the correction at a state; returns false if the state is not admissible.
    ///
    /// # Errors
    /// Any error that prevents the iteration from continuing.
    fn correction_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<bool, GeodesicError>;

    /// Shortens a step that would leave the admissible states.
    fn restrain(&self, x: &[f64], step: &mut [f64]);
}

/// Status of a solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
#[serde(rename_all = "snake_case")]
pub enum SolveStatus {
    /// The correction is below the tolerance.
    Converged,
    /// The maximal number of iterations was reached.
    MaxIterations,
    /// No step makes progress: the solution may not exist, or may be folded.
    Stalled,
    /// The observer cancelled.
    Cancelled,
}

/// Anderson iteration and its stopping criteria.
pub(super) struct Anderson {
    /// Number of previous iterates used.
    pub history: usize,
    /// Maximal number of iterations.
    pub max_iterations: usize,
    /// Tolerance for the norm of the correction.
    pub tolerance: f64,
}

/// Statistics of a solve.
pub(super) struct Solved {
    pub status: SolveStatus,
    pub iterations: usize,
    /// Number of evaluated corrections.
    pub evaluations: usize,
    /// Norm of the correction at the end.
    pub correction: f64,
}

/// The kinds of ends that are remembered, by their numbers.
const ENDS: [SolveStatus; 3] = [
    SolveStatus::Converged,
    SolveStatus::MaxIterations,
    SolveStatus::Stalled,
];

impl Solved {
    /// As numbers; `None` if it was cancelled.
    fn numbers(&self) -> Option<[f64; 4]> {
        let end = ENDS.iter().position(|end| *end == self.status)?;
        let counts = [end, self.iterations, self.evaluations].map(|count| count as f64);
        let [end, iterations, evaluations] = counts;
        Some([end, iterations, evaluations, self.correction])
    }

    fn of_numbers([end, iterations, evaluations, correction]: [f64; 4]) -> Option<Self> {
        Some(Self {
            status: *ENDS.get(end as usize)?,
            iterations: iterations as usize,
            evaluations: evaluations as usize,
            correction,
        })
    }
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
    /// Solves for `x`, which is overwritten by the best state found. The observer is given the result, and
    /// may have it from an earlier run.
    ///
    /// # Errors
    /// Those of the correction.
    pub fn solve<C: Correction>(
        &self,
        problem: &mut C,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Solved, GeodesicError> {
        let memory = observer.resume();
        if let Some((found, numbers)) = memory.as_ref().and_then(|all| all.result(x.len()))
            && let Some(solved) = Solved::of_numbers(numbers)
        {
            x.copy_from_slice(found);
            return Ok(solved);
        }
        let solved = self.compute(problem, x, observer)?;
        if let Some(numbers) = solved.numbers() {
            observer.memory(&Memory::of_result(x, numbers.to_vec()));
        }
        Ok(solved)
    }

    fn compute<C: Correction>(
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
        // The smallest correction when it was last halved, and the iteration at which that was.
        let (mut mark, mut marked) = (first_size, 0);
        for iteration in 0..=self.params.max_iterations {
            let control = observer.iteration(&Iteration {
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
            if control == Control::Cancel {
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

    /// Computes the next state; `None` if no state along the step is admissible.
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

    /// Computes the accelerated step from a correction and the history.
    fn accelerated(&self, f: &[f64], length: f64) -> Vec<f64> {
        let mut step = f.to_vec();
        scale(length, &mut step);
        let n = self.history.len();
        if n == 0 {
            return step;
        }
        // Normal equations of the normalised differences; linearly dependent ones are dropped.
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
