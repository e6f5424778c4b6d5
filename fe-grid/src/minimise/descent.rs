//! Gradient descent with adaptive step length.

use super::counted::Counted;
use super::info::{Info, Status};
use super::line_search::{LineSearch, Start};
use super::monitor::{Monitor, Stopping};
use super::objective::{Evaluation, Minimiser, Objective};
use super::observer::Observer;
use crate::vector::copy_into;

/// Gradient descent in the objective's inverse metric: `x - t P g`.
///
/// The step length `t` begins where the last step ended, times [`DescentParams::growth`], and is
/// halved until Armijo's rule holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DescentParams {
    /// The first trial step length.
    pub first_step: f64,
    /// Factor of the step length after a success.
    pub growth: f64,
    /// Number of iterations after which the metric is recomputed; 0: only at the start.
    pub metric_interval: usize,
    /// The line search.
    pub line_search: LineSearch,
    /// Stopping criteria.
    pub stopping: Stopping,
}

impl Default for DescentParams {
    fn default() -> Self {
        Self {
            first_step: 1.0,
            growth: 2.0,
            metric_interval: 0,
            line_search: LineSearch {
                min_shrink: 0.5,
                max_shrink: 0.5,
                ..LineSearch::default()
            },
            stopping: Stopping {
                max_iterations: 10_000,
                ..Stopping::default()
            },
        }
    }
}

impl<O: Objective> Minimiser<O> for DescentParams {
    fn minimise(
        &self,
        objective: &mut O,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Info, O::Error> {
        assert_eq!(x.len(), objective.dim());
        let mut objective = Counted::new(objective);
        let mut monitor = Monitor::new(&self.stopping, observer);
        let status = self.iterate(&mut objective, x, &mut monitor)?;
        Ok(monitor.finish(status, objective.evaluations))
    }
}

impl DescentParams {
    fn iterate<O: Objective>(
        &self,
        objective: &mut Counted<'_, O>,
        x: &mut [f64],
        monitor: &mut Monitor<'_>,
    ) -> Result<Status, O::Error> {
        let [mut gradient, mut new_gradient, mut direction, mut trial] =
            std::array::from_fn(|_| vec![0.0; x.len()]);
        let first = objective.value_and_gradient(x, &mut gradient[..])?;
        let Evaluation::Value(mut energy) = first else {
            return Ok(Status::InadmissibleStart);
        };
        objective.update_metric(x)?;
        let (mut step_length, mut last_length) = (self.first_step, 0.0);
        for iteration in 1.. {
            let slope = objective.steepest_descent(&gradient[..], &mut direction)?;
            let evaluations = objective.evaluations;
            let scaled = objective.scaled(energy);
            if let Some(status) = monitor.judge(x, scaled, slope, last_length, evaluations) {
                return Ok(status);
            }
            let start = Start {
                x,
                energy,
                direction: &direction[..],
                slope,
                step_length,
            };
            let search = &self.line_search;
            let Some(step) = search.search(objective, &start, &mut trial, &mut new_gradient[..])?
            else {
                return Ok(Status::LineSearchFailed);
            };
            copy_into(&trial, x);
            std::mem::swap(&mut gradient, &mut new_gradient);
            (energy, last_length) = (step.energy, step.length);
            step_length = self.growth * step.length;
            if self.metric_interval > 0 && iteration % self.metric_interval == 0 {
                objective.update_metric(x)?;
            }
        }
        Ok(Status::MaxIterations)
    }
}
