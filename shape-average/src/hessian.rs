//! A model of the Hessian of the reduced functional `J(phi) = min_v E(phi, v)`, applied to a
//! direction.
//!
//! ```text
//! J'' d = E_phiphi d - E_phiv E_vv^-1 E_vphi d
//! ```
//!
//! The elastic energy and the barrier enter with their second derivatives, the mismatch with the
//! model of [`SmoothMatching`]. `E_vv` is twice the matrix of the normal equations. With a prescribed
//! average there is no second term.
//!
//! The first derivatives of `J` jump wherever a quadrature point passes from one cell of the average
//! to the next. The model has the mean curvature over distances of a cell: in motions that the
//! average follows, the second derivative between two jumps is larger by orders of magnitude, and an
//! estimate of the remaining energy with it too small.

use crate::common;
use crate::elastic::{ElasticTerm, elastic_hessian_into};
use crate::equations::solve_equations;
use crate::error::AverageError;
use crate::level::shape;
use crate::objective::AverageObjective;
use crate::params::Precision;
use fe_grid::composition::{Interpolant, MatchDensity, SmoothMatching, nodal_gradient};
use fe_grid::coupling::{Variation, field_derivative_change};
use fe_grid::minimise::{Comparison, NewtonCgParams, SecondOrder};
use fe_grid::scatter::Source;
use fe_grid::vector::{axpy, change_in_double, in_double, scale};
use fe_grid::{Assembly, Data, Element, compiled_once, parallel};
use phasefield::Masked;

/// Relative accuracy of the change of the average: well below that of the model.
const CHANGE_TOLERANCE: f64 = 1e-3;
/// Share of the gradient that the estimate of the remaining energy may leave.
const FORCING: f64 = 0.2;
/// Most Hessian actions of an estimate. On bars, balls and ellipsoids ten more change it by less than a
/// fifth, except where they follow directions of almost no curvature, in which the model says little.
const MOST_ACTIONS: usize = 8;

/// A component of the average of a state, its nodal gradient, and its change in a direction (empty if it
/// is prescribed).
struct Expansion<'a> {
    average: &'a [f64],
    gradient: Vec<f64>,
    change: Vec<f64>,
}

compiled_once! {
    /// Computes the rows of one shape, for a state and a direction of it.
    fn rows_of_shape<'a, D>(
        objective: &'a AverageObjective<D>,
        shape: usize,
        states: (&'a [f64], &'a [f64]),
        expansions: &'a [Expansion<'a>],
        out: &'a mut [f64],
    ) = AverageObjective::shape_hessian;
}

compiled_once! {
    /// Computes the change of the load of a component of the average by one shape, for a state and a direction of
    /// it, and the nodal gradient of the component.
    fn load_change<'a, D>(
        objective: &'a AverageObjective<D>,
        component: usize,
        shape: usize,
        states: (&'a [f64], &'a [f64]),
        gradient: &'a [f64],
    ) -> Vec<f64> = AverageObjective::load_change;
}

impl<const D: usize> SecondOrder for AverageObjective<D> {
    fn hessian_action(
        &mut self,
        x: &[f64],
        direction: &[f64],
        out: &mut [f64],
    ) -> Result<(), AverageError> {
        self.hessian_action_in(x, direction, out)
    }

    fn hessian_action_in<T: Element>(
        &mut self,
        x: &[f64],
        direction: &[T],
        out: &mut [T],
    ) -> Result<(), AverageError> {
        let grid = *self.grid();
        let gradients = self.averages().map(|v| nodal_gradient(&grid, v));
        let mut expansions = Vec::with_capacity(self.shapes.n_components());
        for (c, gradient) in gradients.collect::<Vec<_>>().into_iter().enumerate() {
            let change = if self.fixed {
                Vec::new()
            } else {
                self.average_change(c, x, direction, &gradient)?
            };
            expansions.push((gradient, change));
        }
        let dim = self.shape_dim();
        let this = &*self;
        let expansions = this.averages().zip(expansions);
        let expansions: Vec<Expansion<'_>> = expansions
            .map(|(average, (gradient, change))| Expansion {
                average,
                gradient,
                change,
            })
            .collect();
        let apply = |(i, out): (usize, &mut [T])| {
            let direction = in_double(shape(direction, i, dim));
            let states = (shape(x, i, dim), &*direction);
            change_in_double(out, |out| {
                rows_of_shape(this, i, states, &expansions, out);
            });
        };
        let parts = out.chunks_exact_mut(dim).enumerate();
        if this.in_turn() {
            parts.for_each(apply);
        } else {
            parallel::for_each(parts, &apply);
        }
        Ok(())
    }
}

impl<const D: usize> AverageObjective<D> {
    /// Estimates the energy above the minimum at a state; `None` where it is inadmissible. `share` of the
    /// elastic energy is little enough; whether more is `above_suffices`, see [`Comparison`].
    pub(crate) fn remaining(
        &mut self,
        x: &[f64],
        share: f64,
        above_suffices: bool,
    ) -> Result<Option<f64>, AverageError> {
        let newton = NewtonCgParams {
            max_forcing: FORCING,
            max_inner_iterations: MOST_ACTIONS,
            ..NewtonCgParams::default()
        };
        let comparison = |this: &Self| Comparison {
            limit: share * this.elastic_scale(),
            above_suffices,
        };
        self.common_regularisation = common::ESTIMATE;
        let remaining = match self.params.precision_on(self.grid()) {
            Precision::Double => newton.remaining::<f64, _>(self, x, comparison),
            Precision::Mixed => newton.remaining::<f32, _>(self, x, comparison),
        };
        self.common_regularisation = common::MINIMISATION;
        remaining
    }

    /// Computes the derivative of a component of the average along a direction.
    fn average_change<T: Element>(
        &mut self,
        component: usize,
        x: &[f64],
        direction: &[T],
        gradient: &[f64],
    ) -> Result<Vec<f64>, AverageError> {
        let dim = self.shape_dim();
        let n = self.grid().n_nodes();
        let this = &*self;
        let of_shape = |i: usize| {
            let direction = in_double(shape(direction, i, dim));
            let states = (shape(x, i, dim), &*direction);
            load_change(this, component, i, states, gradient)
        };
        let loads: Vec<Vec<f64>> = (0..self.shapes.n_own()).map(of_shape).collect();
        let mut load = self.shapes.distribution().sum_vectors(&loads, n);
        // The matrix is half the second derivative.
        scale(-0.5, &mut load);
        let mut change = vec![0.0; n];
        let (equations, scratch) = (&self.equations[component], &mut self.scratch);
        self.average_iterations +=
            solve_equations(equations, &load, &mut change, CHANGE_TOLERANCE, scratch)?;
        Ok(change)
    }

    fn load_change(
        &self,
        component: usize,
        shape: usize,
        (displacement, direction): (&[f64], &[f64]),
        gradient: &[f64],
    ) -> Vec<f64> {
        let grid = self.grid();
        let n = grid.n_nodes();
        let average = &self.average[component * n..(component + 1) * n];
        let (rule, average) = (self.mismatch_rule(1.0), Interpolant::new(*grid, average));
        let coefficients = self.shapes.match_coefficients(shape, component);
        let variation = Variation {
            source: Source {
                displacement,
                coefficients: &coefficients,
                weight: self.share(shape),
            },
            direction,
        };
        let mut load = vec![0.0; n];
        if self.shapes.seen().is_empty() {
            let model = SmoothMatching::new(rule, average, gradient);
            field_derivative_change(grid, &model, &variation, &mut load);
        } else {
            let model = SmoothMatching::new(Masked(rule), average, gradient);
            field_derivative_change(grid, &model, &variation, &mut load);
        }
        load
    }

    fn shape_hessian(
        &self,
        shape: usize,
        (displacement, direction): (&[f64], &[f64]),
        expansions: &[Expansion<'_>],
        out: &mut [f64],
    ) {
        let rule = self.mismatch_rule(self.share(shape));
        let states = (displacement, direction);
        let mut image = vec![0.0; out.len()];
        for (c, expansion) in expansions.iter().enumerate() {
            let part = (c, expansion);
            let own = if c == 0 { &mut *out } else { &mut image[..] };
            if self.shapes.seen().is_empty() {
                self.mismatch_hessian(rule, shape, states, part, own);
            } else {
                self.mismatch_hessian(Masked(rule), shape, states, part, own);
            }
            if c > 0 {
                axpy(1.0, &image, out);
            }
        }
        let term = ElasticTerm {
            law: &self.law,
            indicator: self.shapes.indicators[shape].as_slice(),
            void_stiffness: self.params.void_stiffness,
            displacement,
            factor: 1.0,
            gradient: &mut image,
        };
        elastic_hessian_into(term, direction, self.grid());
        axpy(self.elastic_weight(shape), &image, out);
        if self.near_folding(displacement) {
            let barrier = self.barrier();
            barrier.hessian_action_into(self.grid(), displacement, direction, &mut image);
            axpy(1.0, &image, out);
        }
        self.hold_boundary(out);
    }

    fn mismatch_hessian<F: MatchDensity>(
        &self,
        density: F,
        shape: usize,
        (displacement, direction): (&[f64], &[f64]),
        (component, change): (usize, &Expansion<'_>),
        out: &mut [f64],
    ) {
        let grid = *self.grid();
        let coefficients = self.shapes.match_coefficients(shape, component);
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let average = Interpolant::new(grid, change.average);
        let mut model = SmoothMatching::new(density, average, &change.gradient);
        if !change.change.is_empty() {
            model = model.with_change(Interpolant::new(grid, &change.change));
        }
        Assembly::new(grid, &model, data).hessian_action_into(displacement, direction, out);
    }
}
