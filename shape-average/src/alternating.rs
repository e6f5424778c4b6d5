//! Alternating minimisation, as in the lecture notes: solves for the average, then takes a few
//! gradient steps for each shape, and repeats.
//!
//! The gradient is taken in the inner product `(.,.) + sigma^2/2 (D., D.)`, inverted exactly, and
//! the step length is doubled after a success and halved until Armijo's condition holds.

use crate::error::AverageError;
use crate::objective::AverageObjective;
use crate::params::BoundaryCondition;
use fe_grid::minimise::{
    Control, Evaluation, Evaluations, Info, Iteration, Minimiser, Objective, Observer, Status,
};
use fe_grid::{Boundary, SpectralSolver, vector};

/// Constant of the Armijo condition.
const ARMIJO: f64 = 1e-4;
/// Maximal number of step halvings; a shape whose search fails is not changed until the next solve.
const MAX_HALVINGS: usize = 30;

/// Alternating descent. Parameters of the functional are those of the objective.
#[derive(Clone, Copy, Debug)]
pub struct Alternating {
    /// Maximal number of outer iterations.
    pub max_iterations: usize,
    /// Relative tolerance: the iteration ends when five outer iterations decrease the energy by
    /// less than this fraction of the elastic energy, as [`AverageObjective`] measures it.
    pub tolerance: f64,
    /// The iteration ends when the energy has reached this value.
    pub target: Option<f64>,
}

struct Descent<const D: usize> {
    inverse_metric: SpectralSolver<D>,
    gradient: Vec<f64>,
    direction: Vec<f64>,
    trial: Vec<f64>,
    steps: Vec<f64>,
    evaluations: Evaluations,
}

impl<const D: usize> Minimiser<AverageObjective<D>> for Alternating {
    fn minimise(
        &self,
        objective: &mut AverageObjective<D>,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Info, AverageError> {
        let dim = objective.shape_dim();
        let n = objective.dim() / dim;
        let mut descent = Descent::new(objective, n)?;
        let mut energies = Vec::new();
        let mut norms = (0.0, 0.0);
        let status = loop {
            descent.evaluations.values += 1;
            let Evaluation::Value(energy) = objective.value(x)? else {
                break Status::InadmissibleStart;
            };
            energies.push(energy);
            let iteration = Iteration {
                iteration: energies.len() - 1,
                energy,
                gradient_norm: norms.1,
                step_length: descent.steps.iter().fold(0.0, |a: f64, b| a.max(*b)),
                evaluations: descent.evaluations,
                x,
            };
            if observer.iteration(&iteration) == Control::Cancel {
                break Status::Cancelled;
            }
            if self.target.is_some_and(|target| energy <= target)
                || self.stalled(objective, &energies)
            {
                break Status::EnergyTolerance;
            }
            if energies.len() > self.max_iterations {
                break Status::MaxIterations;
            }
            let mut squared = 0.0;
            for i in 0..n {
                let steps = objective.params().descent_steps;
                squared += descent.improve(objective, i, shape_mut(x, i, dim), steps)?;
            }
            norms.1 = squared.sqrt();
            if energies.len() == 1 {
                norms.0 = norms.1;
            }
        };
        let iterations = energies.len().saturating_sub(1);
        let evaluations = descent.evaluations;
        let (first_gradient_norm, gradient_norm) = norms;
        Ok(Info {
            status,
            iterations,
            evaluations,
            energies,
            first_gradient_norm,
            gradient_norm,
        })
    }
}

impl Alternating {
    fn stalled<O: Objective>(&self, objective: &O, energies: &[f64]) -> bool {
        const WINDOW: usize = 5;
        let last = energies[energies.len() - 1];
        energies.len() > WINDOW
            && energies[energies.len() - 1 - WINDOW] - last
                <= self.tolerance * objective.energy_scale(last)
    }
}

fn shape_mut(x: &mut [f64], i: usize, dim: usize) -> &mut [f64] {
    &mut x[i * dim..(i + 1) * dim]
}

impl<const D: usize> Descent<D> {
    fn new(objective: &AverageObjective<D>, n_shapes: usize) -> Result<Self, AverageError> {
        let params = objective.params();
        let boundary = match params.boundary {
            BoundaryCondition::Natural => Boundary::Natural,
            BoundaryCondition::Identity => Boundary::Dirichlet,
        };
        let half_square = 0.5 * params.filter_width.powi(2) * objective.grid().spacing();
        let inverse_metric =
            SpectralSolver::new(*objective.grid(), 1.0, half_square, boundary)?.with_components(D);
        let zeros = || vec![0.0; objective.shape_dim()];
        Ok(Self {
            inverse_metric,
            gradient: zeros(),
            direction: zeros(),
            trial: zeros(),
            steps: vec![1.0; n_shapes],
            evaluations: Evaluations::default(),
        })
    }

    /// Takes gradient steps for one shape with the average fixed; returns the squared norm of its
    /// last gradient in the metric.
    fn improve(
        &mut self,
        objective: &mut AverageObjective<D>,
        i: usize,
        u: &mut [f64],
        steps: usize,
    ) -> Result<f64, AverageError> {
        let mut squared = 0.0;
        for _ in 0..steps {
            objective.shape_evaluations += 1;
            self.evaluations.gradients += 1;
            let Some(corner) = objective.admissible(u) else {
                break;
            };
            let Some(terms) = objective.shape_energy(i, u, corner, &mut self.gradient)? else {
                break;
            };
            let energy = objective.weigh(i, terms);
            self.inverse_metric
                .solve_into(&self.gradient, &mut self.direction);
            objective.hold_boundary(&mut self.direction);
            squared = vector::dot(&self.gradient, &self.direction);
            if squared <= 0.0 || !self.search(objective, i, u, energy, squared)? {
                break;
            }
        }
        Ok(squared)
    }

    /// Backtracks until the Armijo condition holds; `false` if no step decreases the energy.
    fn search(
        &mut self,
        objective: &mut AverageObjective<D>,
        i: usize,
        u: &mut [f64],
        energy: f64,
        squared: f64,
    ) -> Result<bool, AverageError> {
        let mut step = 2.0 * self.steps[i];
        for _ in 0..MAX_HALVINGS {
            vector::add_scaled_into(u, -step, &self.direction, &mut self.trial);
            if let Some(corner) = objective.admissible(&self.trial) {
                objective.shape_evaluations += 1;
                self.evaluations.values += 1;
                let terms = objective.shape_energy(i, &self.trial, corner, &mut [])?;
                let bound = energy - ARMIJO * step * squared;
                if terms.is_some_and(|terms| objective.weigh(i, terms) <= bound) {
                    u.copy_from_slice(&self.trial);
                    self.steps[i] = step;
                    return Ok(true);
                }
            }
            step *= 0.5;
        }
        Ok(false)
    }
}
