//! The functional as one that is minimised: its metric, its step bounds, and what is kept between
//! evaluations.

use super::{AverageObjective, Metric, N_COUNTERS};
use crate::common::CommonMotion;
use crate::error::AverageError;
use crate::level::shape;
use crate::metric::ShapeMetric;
use fe_grid::minimise::{Evaluation, Objective};
use fe_grid::vector::{change_in_double, copy_into};
use fe_grid::{Buffer, Distribution, Element, Stored, parallel, restrain_step};

impl<const D: usize> Objective for AverageObjective<D> {
    type Error = AverageError;

    fn dim(&self) -> usize {
        self.shapes.n_own() * self.shape_dim()
    }

    fn distribution(&self) -> Distribution {
        self.shapes.distribution().clone()
    }

    fn value_and_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, AverageError> {
        self.evaluate(x, gradient)
    }

    fn value_and_gradient_in<T: Element>(
        &mut self,
        x: &[f64],
        gradient: &mut [T],
    ) -> Result<Evaluation, AverageError> {
        self.evaluate(x, gradient)
    }

    fn value(&mut self, x: &[f64]) -> Result<Evaluation, AverageError> {
        self.evaluate_energy(x)
    }

    /// The elastic energy: the mismatch, which is larger by orders of magnitude, has a part that no
    /// deformation can lower.
    fn energy_scale(&self, _energy: f64) -> f64 {
        self.rounds.tightening() * self.elastic_scale()
    }

    fn apply_inverse_metric(
        &mut self,
        gradient: &[f64],
        out: &mut [f64],
    ) -> Result<(), AverageError> {
        self.apply_inverse_metric_in(gradient, out)
    }

    fn apply_inverse_metric_in<T: Element>(
        &mut self,
        gradient: &[T],
        out: &mut [T],
    ) -> Result<(), AverageError> {
        let dim = self.shape_dim();
        let apply = |i: usize, metric: &ShapeMetric<D>, out: &mut [T]| {
            metric.apply_in(shape(gradient, i, dim), out);
            self.hold_boundary(out);
        };
        match &self.metric {
            Metric::Kept(metrics) => {
                let parts = out.chunks_exact_mut(dim).zip(metrics).enumerate();
                let apply = |(i, (out, metric)): (usize, (&mut [T], _))| apply(i, metric, out);
                if self.in_turn() {
                    parts.for_each(apply);
                } else {
                    parallel::for_each(parts, &apply);
                }
            }
            Metric::Remade { x, average } => {
                for (i, out) in out.chunks_exact_mut(dim).enumerate() {
                    let metric = self.shape_metric(i, average, shape(x, i, dim))?;
                    apply(i, &metric, out);
                }
                x.rest();
            }
        }
        if let Some(common) = &self.common {
            common.add(gradient, out);
            parallel::for_each(out.chunks_exact_mut(dim), &|out| self.hold_boundary(out));
        }
        Ok(())
    }

    fn restrain(&mut self, x: &[f64], direction: &mut [f64]) -> Result<(), AverageError> {
        self.restrain_in(x, direction)
    }

    fn restrain_in<T: Element>(
        &mut self,
        x: &[f64],
        direction: &mut [T],
    ) -> Result<(), AverageError> {
        let dim = self.shape_dim();
        let bound = self.params.min_determinant;
        let steps = direction.chunks_exact_mut(dim).enumerate();
        parallel::for_each(steps, &|(i, step)| {
            change_in_double(step, |step| {
                restrain_step(self.grid(), shape(x, i, dim), step, bound, None);
            });
        });
        Ok(())
    }

    fn update_metric(&mut self, x: &[f64]) -> Result<(), AverageError> {
        let dim = self.shape_dim();
        // The old metrics are freed first; two at a time would double the memory.
        self.common = None;
        if !self.fixed {
            let weights: Vec<f64> = (0..self.shapes.n_shapes())
                .map(|i| self.weights.of_elastic(i))
                .collect();
            let common = CommonMotion::new(
                &self.shapes,
                &self.params,
                &weights,
                x,
                self.common_regularisation,
            )?;
            self.common = Some(common);
        }
        let old = std::mem::replace(&mut self.metric, Metric::Kept(Vec::new()));
        if self.params.remakes_metrics {
            let mut copy = match old {
                Metric::Remade { x, .. } => x,
                Metric::Kept(_) => self.params.storage.zeros(x.len())?,
            };
            copy_into(x, &mut copy);
            copy.rest();
            self.metric = Metric::Remade {
                x: copy,
                average: self.average.clone(),
            };
            return Ok(());
        }
        drop(old);
        let shapes = 0..self.shapes.n_own();
        let of_shape = |i: usize| self.shape_metric(i, &self.average, shape(x, i, dim));
        let metrics: Result<Vec<_>, _> = if self.in_turn() {
            shapes.map(of_shape).collect()
        } else {
            parallel::try_map(shapes, &of_shape)
        };
        self.metric = Metric::Kept(metrics?);
        Ok(())
    }

    /// The average, which is the initial guess of the next solve, two counters, and the rounds.
    fn memory(&self) -> Vec<f64> {
        let counters: [_; N_COUNTERS] = [self.shape_evaluations, self.average_iterations];
        let counters = counters.iter().map(|count| *count as f64);
        let average = self.average.iter().copied();
        average
            .chain(counters)
            .chain(self.rounds.to_numbers())
            .collect()
    }

    fn restore(&mut self, memory: &[f64]) {
        let n = self.average.len();
        if let [evaluations, iterations, ..] = memory.get(n..).unwrap_or_default() {
            self.recall(memory);
            self.average.copy_from_slice(&memory[..n]);
            self.shape_evaluations = *evaluations as usize;
            self.average_iterations = *iterations as usize;
        }
    }

    fn room<T: Stored>(&self, len: usize) -> Result<Buffer<T>, AverageError> {
        Ok(self.params.storage.zeros(len)?)
    }
}
