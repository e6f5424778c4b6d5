//! L-BFGS on top of the objective's own metric.

use super::counted::Counted;
use super::history::{Pair, PairHistory};
use super::info::{Info, Status};
use super::line_search::{LineSearch, Start, Step};
use super::memory::Memory;
use super::monitor::{Monitor, Stopping, has_new_metric};
use super::objective::{Evaluation, Minimiser, Objective};
use super::observer::Observer;
use super::pair_vector::PairVector;
use crate::buffer::Buffer;
use crate::lane::Element;
use crate::vector::{copy_into, in_double, round_to, scale};

/// L-BFGS whose initial inverse Hessian is the objective's inverse metric.
///
/// The direction is `-H g`, with `H` the inverse Hessian of the two-loop recursion. The gradient
/// is measured by `sqrt(g · H g)`, the metric's own norm in the first iteration; it costs nothing,
/// for `-g · H g` is the slope along the direction. A pair with
/// `s · y <= curvature_threshold |s| |y|` is not stored. If the direction is not a descent
/// direction, or no step along it decreases the energy, the pairs are dropped and `-P g` is tried
/// once, and once more without being restrained.
///
/// A run resumes from the memory that its observer returns ([`Observer::resume`]), to the bits of the
/// run that the memory is from; from the memory of its end there is nothing to compute.
///
/// Source: Nocedal, *Updating quasi-Newton matrices with limited storage* (1980).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LbfgsParams {
    /// Number of stored pairs.
    pub history: usize,
    /// Number of iterations after which the metric is recomputed; the pairs are retained. 0: only
    /// at the start.
    pub metric_interval: usize,
    /// Pairs of less curvature than this (a cosine) are not stored.
    pub curvature_threshold: f64,
    /// Pairs whose curvature along the step is less than this share of what the inverse Hessian that the step was made
    /// with has there are not stored. Where the curvature of an energy changes its sign, some pairs have next to none,
    /// and all steps that heed them are too long by orders of magnitude. 0: all are stored.
    pub least_share: f64,
    /// The first trial step along every direction.
    pub first_step: f64,
    /// The line search.
    pub line_search: LineSearch,
    /// Whether vectors are kept in less memory: the pairs in bytes, all others but the state
    /// in single precision, to which the state is rounded. All is still computed in double precision.
    pub compact: bool,
    /// When to stop.
    pub stopping: Stopping,
}

impl Default for LbfgsParams {
    fn default() -> Self {
        Self {
            history: 15,
            metric_interval: 15,
            curvature_threshold: 1e-10,
            least_share: 0.0,
            first_step: 1.0,
            line_search: LineSearch::default(),
            compact: false,
            stopping: Stopping::default(),
        }
    }
}

/// All vectors of a run but the state, which is the trial state while a step is looked for.
struct Run<'a, O: Objective, T> {
    params: &'a LbfgsParams,
    objective: Counted<'a, O>,
    pairs: PairHistory,
    /// The state that the step begins at.
    start: Buffer<T>,
    gradient: Buffer<T>,
    direction: Buffer<T>,
    new_gradient: Buffer<T>,
    /// Whether the objective shortened the last direction.
    shortened: bool,
}

impl<O: Objective> Minimiser<O> for LbfgsParams {
    fn minimise(
        &self,
        objective: &mut O,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Info, O::Error> {
        if self.compact {
            self.minimise_in::<f32, O>(objective, x, observer)
        } else {
            self.minimise_in::<f64, O>(objective, x, observer)
        }
    }
}

impl LbfgsParams {
    /// Minimises with vectors in the precision of `T`.
    fn minimise_in<T: Element, O: Objective>(
        &self,
        objective: &mut O,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Info, O::Error> {
        let dim = objective.dim();
        assert_eq!(x.len(), dim);
        let objective = Counted::new(objective);
        let vector = || PairVector::new(&objective, dim, self.compact);
        let pairs = (0..self.history)
            .map(|_| Ok(Pair::new(vector()?, vector()?)))
            .collect::<Result<_, O::Error>>()?;
        let mut run = Run::<'_, O, T> {
            params: self,
            pairs: PairHistory::new(pairs, objective.distribution().clone()),
            start: objective.room(dim)?,
            gradient: objective.room(dim)?,
            direction: objective.room(dim)?,
            new_gradient: objective.room(dim)?,
            shortened: false,
            objective,
        };
        round_to::<T>(x);
        let memory = observer.resume();
        let memory = memory.filter(|memory| memory.fits(dim, self.history));
        let mut monitor = Monitor::new(&self.stopping, observer);
        if let Some((memory, ended)) = memory.as_ref().and_then(|all| Some((all, all.ended?))) {
            x.copy_from_slice(&memory.x);
            run.objective.restore(&memory.objective);
            monitor.restore(memory);
            return Ok(monitor.finish_as(ended, memory.evaluations));
        }
        let status = run.iterate(x, &mut monitor, memory)?;
        monitor.remember_end(x, status, &run.objective);
        Ok(monitor.finish(status, run.objective.evaluations))
    }
}

impl<O: Objective, T: Element> Run<'_, O, T> {
    fn iterate(
        &mut self,
        x: &mut [f64],
        monitor: &mut Monitor<'_>,
        memory: Option<Memory<'static>>,
    ) -> Result<Status, O::Error> {
        let mut resumed = None;
        let interval = self.params.metric_interval;
        let (mut energy, mut step_length, first) = if let Some(memory) = memory {
            resumed = Some(memory.evaluations);
            self.restore(&memory, x, monitor)
        } else {
            let first = self
                .objective
                .value_and_gradient(x, &mut self.gradient[..])?;
            let Evaluation::Value(energy) = first else {
                return Ok(Status::InadmissibleStart);
            };
            (energy, 0.0, 1)
        };
        self.objective.update_metric(x)?;
        for iteration in first.. {
            let slope = self.next_direction()?;
            if let Some(evaluations) = resumed.take() {
                // The earlier run has been judged here, and has gone on.
                self.objective.evaluations = evaluations;
                monitor.take_up(slope);
            } else {
                let evaluations = self.objective.evaluations;
                let scaled = self.objective.scaled(energy);
                if let Some(status) = monitor.judge(x, scaled, slope, step_length, evaluations) {
                    return Ok(status);
                }
                if has_new_metric(interval, iteration - 1) {
                    self.remember(x, step_length, monitor);
                }
            }
            let Some(step) = self.step(x, energy)? else {
                return Ok(Status::LineSearchFailed);
            };
            if self.is_curved(&step) {
                let new = (&*x, &self.new_gradient[..]);
                let old = (&self.start[..], &self.gradient[..]);
                self.pairs.push(new, old, self.params.curvature_threshold);
            }
            self.start.rest();
            self.direction.rest();
            std::mem::swap(&mut self.gradient, &mut self.new_gradient);
            (energy, step_length) = (step.energy, step.length);
            if has_new_metric(interval, iteration) {
                self.objective.update_metric(x)?;
            }
        }
        Ok(Status::MaxIterations)
    }

    /// Passes the memory of this run on to the observer; where vectors are to be converted, if it has a use
    /// for it.
    fn remember(&self, x: &[f64], step_length: f64, monitor: &mut Monitor<'_>) {
        if self.params.compact && !monitor.remembers() {
            return;
        }
        monitor.remember(|energies, first_gradient_norm| Memory {
            x: x.into(),
            gradient: in_double(&self.gradient),
            pairs: self.pairs.memory(),
            energies: energies.into(),
            first_gradient_norm,
            step_length,
            evaluations: self.objective.evaluations,
            objective: self.objective.memory().into(),
            ended: None,
        });
    }

    /// Takes over the memory of an earlier run; returns the energy, the factor of the last step, and
    /// the number of the next.
    fn restore(
        &mut self,
        memory: &Memory<'_>,
        x: &mut [f64],
        monitor: &mut Monitor<'_>,
    ) -> (f64, f64, usize) {
        x.copy_from_slice(&memory.x);
        copy_into(&memory.gradient, &mut self.gradient);
        self.pairs.restore(&memory.pairs);
        self.objective.restore(&memory.objective);
        monitor.restore(memory);
        let steps = memory.energies.len();
        (memory.energies[steps - 1], memory.step_length, steps)
    }

    /// Sets the direction and returns the slope along it.
    fn next_direction(&mut self) -> Result<f64, O::Error> {
        // The gradient of the trial state is not in use here and serves as work space.
        copy_into(&self.gradient, &mut self.new_gradient);
        self.pairs.first_loop(&mut self.new_gradient);
        self.objective
            .apply_inverse_metric(&self.new_gradient, &mut self.direction)?;
        self.pairs.second_loop(&mut self.direction);
        scale(-1.0, &mut self.direction);
        let slope = self.slope();
        self.gradient.rest();
        if slope < 0.0 || self.pairs.is_empty() {
            return Ok(slope);
        }
        self.restart()
    }

    /// The slope of the energy along the direction.
    fn slope(&self) -> f64 {
        let distribution = self.objective.distribution();
        distribution.dot(&self.gradient[..], &self.direction[..])
    }

    /// Whether the energy curves upwards along a step by the least share of what was expected.
    fn is_curved(&self, step: &Step) -> bool {
        let least = self.params.least_share;
        if least == 0.0 {
            return true;
        }
        let distribution = self.objective.distribution();
        let (before, after) = (
            self.slope(),
            distribution.dot(&self.new_gradient[..], &self.direction[..]),
        );
        // The direction is -H g, so that its product with the inverse of H is -g . d.
        after - before >= -least * step.length * before
    }

    /// Steepest descent in the objective's metric, with the memory dropped.
    fn restart(&mut self) -> Result<f64, O::Error> {
        self.pairs.clear();
        self.objective
            .steepest_descent(&self.gradient, &mut self.direction)
    }

    /// A step along the direction; where there is none, once more from the memory's start.
    fn step(&mut self, x: &mut [f64], energy: f64) -> Result<Option<Step>, O::Error> {
        copy_into(x, &mut self.start);
        let step = self.search(x, energy, true)?;
        if step.is_some() {
            return Ok(step);
        }
        if !self.pairs.is_empty() {
            self.restart()?;
            let step = self.search(x, energy, true)?;
            if step.is_some() {
                return Ok(step);
            }
        }
        if !self.shortened {
            return Ok(None);
        }
        // What was left of the direction may not descend; the whole does, if not far.
        self.restart()?;
        self.search(x, energy, false)
    }

    /// Looks for a step from `x`, which becomes the new state if there is one, and else stays.
    fn search(
        &mut self,
        x: &mut [f64],
        energy: f64,
        restrained: bool,
    ) -> Result<Option<Step>, O::Error> {
        let mut slope = self.slope();
        if restrained {
            let whole = slope;
            slope = self
                .objective
                .restrain(x, &self.gradient, &mut self.direction)?;
            self.shortened = slope != whole;
        }
        if slope.is_nan() || slope >= 0.0 {
            return Ok(None);
        }
        let start = Start {
            x: &self.start[..],
            energy,
            direction: &self.direction[..],
            slope,
            step_length: self.params.first_step,
        };
        let line_search = &self.params.line_search;
        let (objective, gradient) = (&mut self.objective, &mut self.new_gradient[..]);
        let found = line_search.search(objective, &start, x, gradient);
        if !matches!(found, Ok(Some(_))) {
            copy_into(&self.start, x);
        }
        found
    }
}
