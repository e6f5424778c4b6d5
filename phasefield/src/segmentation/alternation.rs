//! The two systems in turn.

use super::energy::AmbrosioTortorelli;
use super::relax;
use super::relax::Part;
use crate::error::PhaseFieldError;
use fe_grid::minimise::{
    Control, Evaluation, Evaluations, Info, Iteration, Minimiser, Objective, Observer, Status,
};
use fe_grid::{Assembly, Data, Grid};

/// Shares of the cost of an edge that the second start passes through.
const CHEAPER_EDGES: [f64; 2] = [0.25, 0.5];
/// Times that both systems are solved at each of them,
const STEPS: usize = 3;
/// and at the full cost before the two starts are compared.
const TRIAL: usize = 4;

/// The energy on one level. Its state is `u`, then `v`.
pub struct SegmentationObjective<const D: usize> {
    pub(super) grid: Grid<D>,
    pub(super) law: AmbrosioTortorelli,
    /// The image `u0`.
    pub(super) image: Vec<f64>,
    /// Iterations of conjugate gradients for `u` and for `v`.
    pub(super) system_iterations: [usize; 2],
}

impl<const D: usize> SegmentationObjective<D> {
    pub(super) fn relax(&mut self, x: &mut [f64], part: Part) -> Result<f64, PhaseFieldError> {
        let coefficients = [self.image.as_slice()];
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let done = relax(&self.grid, &self.law, data, x, part)?;
        self.system_iterations[part as usize] += done.iterations;
        Ok(done.energy)
    }
}

impl<const D: usize> SegmentationObjective<D> {
    /// Solves for both so many times.
    fn alternate(&mut self, x: &mut [f64], times: usize) -> Result<(), PhaseFieldError> {
        for _ in 0..times {
            self.relax(x, Part::PhaseField)?;
            self.relax(x, Part::Image)?;
        }
        Ok(())
    }

    /// The better of two states to begin with: the one that is given, and the one that edges which
    /// cost less lead to, the cost rising step by step. From a smooth image a jump has to be higher
    /// to become an edge than to stay one, and noise that hides a part of an edge hides it from the
    /// first start only.
    fn better_start(&mut self, x: &mut [f64]) -> Result<(), PhaseFieldError> {
        let mut other = x.to_vec();
        let weight = self.law.weights.edges;
        for share in CHEAPER_EDGES {
            self.law.weights.edges = share * weight;
            let softened = self.alternate(&mut other, STEPS);
            self.law.weights.edges = weight;
            softened?;
        }
        let mut given = x.to_vec();
        self.alternate(&mut given, TRIAL)?;
        self.alternate(&mut other, TRIAL)?;
        if self.energy(&other)? < self.energy(&given)? {
            given = other;
        }
        x.copy_from_slice(&given);
        Ok(())
    }

    fn energy(&self, x: &[f64]) -> Result<f64, PhaseFieldError> {
        let coefficients = [self.image.as_slice()];
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        Ok(Assembly::new(self.grid, &self.law, data).value(x)?)
    }
}

impl<const D: usize> Objective for SegmentationObjective<D> {
    type Error = PhaseFieldError;

    fn dim(&self) -> usize {
        2 * self.grid.n_nodes()
    }

    fn value_and_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, PhaseFieldError> {
        let coefficients = [self.image.as_slice()];
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let assembly = Assembly::new(self.grid, &self.law, data);
        let energy = assembly.value_and_gradient_into(x, gradient)?;
        Ok(Evaluation::Value(energy))
    }
}

/// Solves for the phase field and for the image in turn, in this order: the image of a coarser
/// level is smooth, and only its edges are seen by the phase field. The other way round the wide
/// edges of the coarser level would let the noise of the finer one in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alternation {
    /// Ends when solving both lowers the energy by less than this share of it.
    pub tolerance: f64,
    /// Most times that both are solved.
    pub max_iterations: usize,
}

impl<const D: usize> Minimiser<SegmentationObjective<D>> for Alternation {
    fn minimise(
        &self,
        objective: &mut SegmentationObjective<D>,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Info, PhaseFieldError> {
        let mut energies: Vec<f64> = Vec::new();
        let mut evaluations = Evaluations::default();
        objective.better_start(x)?;
        let mut last = x.to_vec();
        let status = loop {
            // The relaxation tells the energy before it: the next state is computed ahead, and
            // thrown away where the last one was good enough.
            let mut next = x.to_vec();
            let energy = objective.relax(&mut next, Part::PhaseField)?;
            evaluations.gradients += 1;
            // At the minimum rounding is all that is left of a step.
            if energies.last().is_some_and(|&before| energy > before) {
                x.copy_from_slice(&last);
                break Status::EnergyTolerance;
            }
            energies.push(energy);
            let iteration = Iteration {
                iteration: energies.len() - 1,
                energy,
                gradient_norm: 0.0,
                step_length: 1.0,
                evaluations,
                x,
            };
            if observer.iteration(&iteration) == Control::Cancel {
                break Status::Cancelled;
            }
            if let [.., before, last] = energies[..]
                && before - last <= self.tolerance * last
            {
                break Status::EnergyTolerance;
            }
            if energies.len() > self.max_iterations {
                break Status::MaxIterations;
            }
            objective.relax(&mut next, Part::Image)?;
            evaluations.gradients += 1;
            last.copy_from_slice(x);
            x.copy_from_slice(&next);
        };
        Ok(Info {
            status,
            iterations: energies.len() - 1,
            evaluations,
            energies,
            first_gradient_norm: 0.0,
            gradient_norm: 0.0,
        })
    }
}
