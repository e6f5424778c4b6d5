//! Alternating minimisation, as in the lecture notes: solves for the average, then takes a few
//! gradient steps for each shape, and repeats.
//!
//! The gradient is taken in the inner product `(.,.) + sigma^2/2 (D., D.)`, inverted exactly, and
//! the step length is doubled after a success and halved until Armijo's condition holds.

use crate::error::AverageError;
use crate::objective::AverageObjective;
use crate::params::BoundaryCondition;
use fe_grid::minimise::{
    Control, Ended, Evaluation, Evaluations, Info, Iteration, Memory, Minimiser, Objective,
    Observer, Status,
};
use fe_grid::{Boundary, SpectralSolver, vector};

/// Constant of the Armijo condition.
const ARMIJO: f64 = 1e-4;
/// Maximal number of step halvings; a shape whose search fails is not changed until the next solve.
const MAX_HALVINGS: usize = 30;

/// Number of iterations between two memories for the observer.
const REMEMBERED: usize = 8;

/// Alternating descent, which resumes from its memory as L-BFGS does. Parameters of the functional are those of the objective.
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
        let memory = observer.resume();
        let memory = memory.filter(|memory| {
            memory.x.len() == x.len() && memory.objective.len() > n && !memory.energies.is_empty()
        });
        if let Some(memory) = &memory {
            x.copy_from_slice(&memory.x);
            energies.extend_from_slice(&memory.energies);
            norms = (memory.first_gradient_norm, memory.step_length);
            descent.evaluations = memory.evaluations;
            let (steps, rest) = memory.objective.split_at(n);
            descent.steps.copy_from_slice(steps);
            objective.restore(rest);
            if let Some(ended) = memory.ended {
                return Ok(descent.info(ended.status, energies, norms));
            }
        }
        let status = loop {
            if !energies.is_empty() && energies.len().is_multiple_of(REMEMBERED) {
                observer.memory(&descent.memory(objective, x, &energies, norms));
            }
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
        if !matches!(status, Status::Cancelled | Status::InadmissibleStart) {
            observer.memory(&Memory {
                ended: Some(Ended {
                    status,
                    gradient_norm: norms.1,
                }),
                ..descent.memory(objective, x, &energies, norms)
            });
        }
        Ok(descent.info(status, energies, norms))
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
            // Gradients are proportional to the moduli.
            steps: vec![1.0 / params.law.moduli.mu; n_shapes],
            evaluations: Evaluations::default(),
        })
    }

    /// The memory before the next evaluation: the step lengths are in front of what the objective
    /// remembers, and the size of the last gradient stands for the factor of the last step.
    fn memory<'a>(
        &self,
        objective: &AverageObjective<D>,
        x: &'a [f64],
        energies: &'a [f64],
        norms: (f64, f64),
    ) -> Memory<'a> {
        let numbers = [self.steps.clone(), objective.memory()].concat();
        Memory {
            energies: energies.into(),
            first_gradient_norm: norms.0,
            step_length: norms.1,
            evaluations: self.evaluations,
            ended: None,
            ..Memory::of_result(x, numbers)
        }
    }

    /// The record of a run.
    fn info(&self, status: Status, energies: Vec<f64>, norms: (f64, f64)) -> Info {
        Info {
            status,
            iterations: energies.len().saturating_sub(1),
            evaluations: self.evaluations,
            energies,
            first_gradient_norm: norms.0,
            gradient_norm: norms.1,
        }
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
            let energy = objective.weigh(i, &terms);
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
                if terms.is_some_and(|terms| objective.weigh(i, &terms) <= bound) {
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
