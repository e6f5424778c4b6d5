//! Newton's method with truncated conjugate gradients.

use super::counted::Counted;
use super::info::{Info, Status};
use super::line_search::{LineSearch, Start};
use super::memory::Memory;
use super::monitor::{Monitor, Stopping, has_new_metric};
use super::objective::{Evaluation, Minimiser, SecondOrder};
use super::observer::Observer;
use crate::buffer::Buffer;
use crate::lane::Element;
use crate::vector::{axpy, aypx, copy_into, fill, scale};

/// Inexact Newton: `H d = -g` is solved by conjugate gradients, preconditioned by the objective's
/// inverse metric `P`, until `sqrt(r · P r) <= forcing sqrt(g · P g)`.
///
/// `forcing = min(max_forcing, 0.9 (|g_k| / |g_{k-1}|)^2)` with the safeguard of Eisenstat and
/// Walker. Where a direction of non-positive curvature turns up, the last good `d` is used, and
/// `-P g` where there is none.
///
/// Sources: Eisenstat and Walker, *Choosing the forcing terms in an inexact Newton method* (1996),
/// choice 2; Steihaug, *The conjugate gradient method and trust regions in large scale
/// optimization* (1983).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonCgParams {
    /// Largest share of the gradient that an inner solve may leave.
    pub max_forcing: f64,
    /// Maximal number of inner iterations, with one application of the Hessian each.
    pub max_inner_iterations: usize,
    /// Number of iterations after which the metric is recomputed. 0: only at the start.
    pub metric_interval: usize,
    /// The line search; it begins with the whole Newton step.
    pub line_search: LineSearch,
    /// Stopping criteria.
    pub stopping: Stopping,
}

impl Default for NewtonCgParams {
    fn default() -> Self {
        Self {
            max_forcing: 0.5,
            max_inner_iterations: 100,
            metric_interval: 1,
            line_search: LineSearch::default(),
            stopping: Stopping::default(),
        }
    }
}

/// Choice 2 of Eisenstat and Walker: factor and safeguard.
const FORCING_FACTOR: f64 = 0.9;
const FORCING_SAFEGUARD: f64 = 0.1;

/// Numbers of a memory that are not those of the objective: the forcing term, and the size of the gradient before.
const OWN_NUMBERS: usize = 2;

/// What an estimate of the remaining energy is compared with.
///
/// The energy of the model falls with every iteration of the inner solve, by half of `(r · P r)² / (d · H d)`.
/// The sum of these gains is a lower bound of the estimate, and they fall slowly, if at all: an estimate that
/// stays below the limit with the largest gain in place of all that are missing ends there, unless the gains
/// still rise, with the last one in their place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Energies up to here are small enough.
    pub limit: f64,
    /// Whether the estimate is not needed where it is above the limit: it may be too small there.
    pub above_suffices: bool,
}

/// Least number of gains from which the others are foretold.
const LEAST_GAINS: usize = 2;

/// The gains of the first iterations of an inner solve.
struct Gains {
    /// Number of iterations that are still allowed.
    missing: usize,
    found: usize,
    sum: f64,
    largest: f64,
    last: f64,
}

impl Gains {
    fn new(missing: usize) -> Self {
        Self {
            missing,
            found: 0,
            sum: 0.0,
            largest: 0.0,
            last: 0.0,
        }
    }

    fn add(&mut self, gain: f64) {
        self.missing = self.missing.saturating_sub(1);
        self.found += 1;
        self.sum += gain;
        self.largest = self.largest.max(gain);
        self.last = gain;
    }

    /// The sum of all gains, if those that are missing are like the last one.
    fn foretold(&self) -> f64 {
        self.sum + self.missing as f64 * self.last
    }

    /// Whether the comparison is clear.
    fn decide(&self, comparison: &Comparison) -> bool {
        let most = self.sum + self.missing as f64 * self.largest;
        let falling = self.found >= LEAST_GAINS && self.last < self.largest;
        let below = falling && most <= comparison.limit;
        below || comparison.above_suffices && self.sum > comparison.limit
    }
}

/// All vectors of a run.
struct Run<'a, O: SecondOrder, T> {
    params: &'a NewtonCgParams,
    objective: Counted<'a, O>,
    gradient: Buffer<T>,
    residual: Buffer<T>,
    preconditioned: Buffer<T>,
    search: Buffer<T>,
    image: Buffer<T>,
    direction: Buffer<T>,
}

impl NewtonCgParams {
    /// Estimates the energy above the minimum: half the Newton decrement, `-(g · d + 1/2 d · H d)` of
    /// the first inner solve. What that solve leaves undone is a share of about the square of
    /// [`NewtonCgParams::max_forcing`]. `None` where the state is inadmissible. Vectors are kept in the
    /// precision of `T`.
    ///
    /// What the estimate is compared with is asked after the evaluation of the state; the solve ends where the
    /// comparison is clear, see [`Comparison`].
    ///
    /// # Errors
    /// Those of the objective.
    pub fn remaining<T: Element, O: SecondOrder>(
        &self,
        objective: &mut O,
        x: &[f64],
        comparison: impl FnOnce(&O) -> Comparison,
    ) -> Result<Option<f64>, O::Error> {
        let mut run = Run::<'_, O, T>::new(self, objective)?;
        let found = run.objective.value_and_gradient(x, &mut run.gradient[..])?;
        if found == Evaluation::Inadmissible {
            return Ok(None);
        }
        let comparison = comparison(run.objective.objective());
        run.objective.update_metric(x)?;
        let squared_size = run.precondition_gradient()?;
        let mut gains = Gains::new(self.max_inner_iterations);
        let slope = run.newton_direction(x, self.max_forcing, squared_size, |gain| {
            gains.add(gain);
            gains.decide(&comparison)
        })?;
        let whole = 0.5 * slope.abs();
        Ok(Some(if gains.decide(&comparison) {
            whole.max(gains.foretold())
        } else {
            whole
        }))
    }
}

impl<O: SecondOrder> Minimiser<O> for NewtonCgParams {
    fn minimise(
        &self,
        objective: &mut O,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Info, O::Error> {
        assert_eq!(x.len(), objective.dim());
        let mut run = Run::<'_, O, f64>::new(self, objective)?;
        let memory = observer.resume();
        let is_own =
            |memory: &Memory<'_>| memory.ended.is_some() || memory.objective.len() >= OWN_NUMBERS;
        let memory = memory.filter(|memory| memory.fits(x.len(), 0) && is_own(memory));
        let mut monitor = Monitor::new(&self.stopping, observer);
        if let Some((memory, ended)) = memory.as_ref().and_then(|all| Some((all, all.ended?))) {
            x.copy_from_slice(&memory.x);
            monitor.restore(memory);
            return Ok(monitor.finish_as(ended, memory.evaluations));
        }
        let status = run.iterate(x, &mut monitor, memory)?;
        monitor.remember_end(x, status, &run.objective);
        Ok(monitor.finish(status, run.objective.evaluations))
    }
}

impl<'a, O: SecondOrder, T: Element> Run<'a, O, T> {
    fn new(params: &'a NewtonCgParams, objective: &'a mut O) -> Result<Self, O::Error> {
        let dim = objective.dim();
        Ok(Self {
            params,
            gradient: objective.room(dim)?,
            residual: objective.room(dim)?,
            preconditioned: objective.room(dim)?,
            search: objective.room(dim)?,
            image: objective.room(dim)?,
            direction: objective.room(dim)?,
            objective: Counted::new(objective),
        })
    }
}

impl<O: SecondOrder> Run<'_, O, f64> {
    fn iterate(
        &mut self,
        x: &mut [f64],
        monitor: &mut Monitor<'_>,
        memory: Option<Memory<'static>>,
    ) -> Result<Status, O::Error> {
        let mut resumed = None;
        let interval = self.params.metric_interval;
        let (mut energy, mut step_length, first);
        let (mut forcing, mut last_size) = (self.params.max_forcing, None);
        if let Some(memory) = memory {
            x.copy_from_slice(&memory.x);
            copy_into(&memory.gradient, &mut self.gradient);
            let (known, of_objective) = memory.objective.split_at(OWN_NUMBERS);
            (forcing, last_size) = (known[0], Some(known[1]).filter(|size| *size >= 0.0));
            self.objective.restore(of_objective);
            monitor.restore(&memory);
            first = memory.energies.len();
            (energy, step_length) = (memory.energies[first - 1], memory.step_length);
            resumed = Some(memory.evaluations);
        } else {
            let found = self
                .objective
                .value_and_gradient(x, &mut self.gradient[..])?;
            let Evaluation::Value(value) = found else {
                return Ok(Status::InadmissibleStart);
            };
            (energy, step_length, first) = (value, 0.0, 1);
        }
        self.objective.update_metric(x)?;
        for iteration in first.. {
            let squared_size = self.precondition_gradient()?;
            if let Some(evaluations) = resumed.take() {
                // The earlier run has been judged here, and has gone on.
                self.objective.evaluations = evaluations;
                monitor.take_up(-squared_size);
            } else {
                let evaluations = self.objective.evaluations;
                let scaled = self.objective.scaled(energy);
                let judgement = monitor.judge(x, scaled, -squared_size, step_length, evaluations);
                if let Some(status) = judgement {
                    return Ok(status);
                }
                if has_new_metric(interval, iteration - 1) {
                    self.remember(x, step_length, (forcing, last_size), monitor);
                }
            }
            let size = squared_size.sqrt();
            if let Some(last) = last_size {
                forcing = self.next_forcing(forcing, size / last);
            }
            last_size = Some(size);
            self.newton_direction(x, forcing, squared_size, |_| false)?;
            let slope = self
                .objective
                .restrain(x, &self.gradient, &mut self.direction)?;
            let start = Start {
                x,
                energy,
                direction: &self.direction[..],
                slope,
                step_length: 1.0,
            };
            // The vectors of the inner solve are free again.
            let (trial, new_gradient) = (&mut self.search, &mut self.residual[..]);
            let search = &self.params.line_search;
            let Some(step) = search.search(&mut self.objective, &start, trial, new_gradient)?
            else {
                return Ok(Status::LineSearchFailed);
            };
            copy_into(&self.search, x);
            std::mem::swap(&mut self.gradient, &mut self.residual);
            (energy, step_length) = (step.energy, step.length);
            if has_new_metric(interval, iteration) {
                self.objective.update_metric(x)?;
            }
        }
        Ok(Status::MaxIterations)
    }

    /// Passes the memory of this run on to the observer. Before that of the objective stand the forcing term and
    /// the size of the gradient before, -1 for none.
    fn remember(
        &self,
        x: &[f64],
        step_length: f64,
        (forcing, last_size): (f64, Option<f64>),
        monitor: &mut Monitor<'_>,
    ) {
        let mut numbers = vec![forcing, last_size.unwrap_or(-1.0)];
        numbers.extend(self.objective.memory());
        monitor.remember(|energies, first_gradient_norm| Memory {
            gradient: (&self.gradient[..]).into(),
            energies: energies.into(),
            first_gradient_norm,
            step_length,
            evaluations: self.objective.evaluations,
            ended: None,
            ..Memory::of_result(x, numbers)
        });
    }

    fn next_forcing(&self, last_forcing: f64, ratio: f64) -> f64 {
        let forcing = FORCING_FACTOR * ratio * ratio;
        let safeguard = FORCING_FACTOR * last_forcing * last_forcing;
        let forcing = if safeguard > FORCING_SAFEGUARD {
            forcing.max(safeguard)
        } else {
            forcing
        };
        forcing.min(self.params.max_forcing)
    }
}

impl<O: SecondOrder, T: Element> Run<'_, O, T> {
    fn dot(&self, x: &[T], y: &[T]) -> f64 {
        self.objective.distribution().dot(x, y)
    }

    /// `preconditioned = P g`; returns `g · P g`.
    fn precondition_gradient(&mut self) -> Result<f64, O::Error> {
        self.objective
            .apply_inverse_metric(&self.gradient, &mut self.preconditioned)?;
        Ok(self.dot(&self.gradient, &self.preconditioned))
    }

    /// Solves `H d = -g` as far as the forcing asks, given `preconditioned = P g` and
    /// `g · P g`, or until `ends` says so, which is told by how much the energy of the model falls with every
    /// iteration; returns the slope along `d`.
    fn newton_direction(
        &mut self,
        x: &[f64],
        forcing: f64,
        squared_size: f64,
        mut ends: impl FnMut(f64) -> bool,
    ) -> Result<f64, O::Error> {
        // With the signs of the system `H d = r`, `r = -g`.
        copy_into(&self.gradient, &mut self.residual);
        scale(-1.0, &mut self.residual);
        scale(-1.0, &mut self.preconditioned);
        copy_into(&self.preconditioned, &mut self.search);
        fill(0.0, &mut self.direction);
        let mut product = squared_size;
        let enough = forcing * forcing * squared_size;
        for inner in 0..self.params.max_inner_iterations {
            self.objective
                .hessian_action(x, &self.search, &mut self.image)?;
            let curvature = self.dot(&self.search, &self.image);
            if !(curvature > 0.0 && curvature.is_finite()) {
                if inner == 0 {
                    copy_into(&self.search, &mut self.direction);
                }
                break;
            }
            let step = product / curvature;
            axpy(step, &self.search, &mut self.direction);
            if ends(0.5 * step * product) {
                break;
            }
            axpy(-step, &self.image, &mut self.residual);
            self.objective
                .apply_inverse_metric(&self.residual, &mut self.preconditioned)?;
            let next = self.dot(&self.residual, &self.preconditioned);
            if next.is_nan() || next <= enough {
                break;
            }
            aypx(next / product, &self.preconditioned, &mut self.search);
            product = next;
        }
        Ok(self.dot(&self.gradient, &self.direction))
    }
}
