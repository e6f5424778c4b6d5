//! Alternating solution of the two systems.

use super::energy::AmbrosioTortorelli;
use super::relax;
use super::relax::Part;
use crate::error::PhaseFieldError;
use fe_grid::minimise::{
    Control, Ended, Evaluation, Evaluations, Info, Iteration, Memory, Minimiser, Objective,
    Observer, Status,
};
use fe_grid::{Assembly, Data, Grid};

/// Reduced costs of an edge for the second start, as fractions of the full cost.
const CHEAPER_EDGES: [f64; 2] = [0.25, 0.5];
/// Number of alternations at each of them,
const STEPS: usize = 3;
/// and at the full cost before the two starts are compared.
const TRIAL: usize = 4;

/// The energy on one level. The unknowns are `u`, then `v`.
pub struct SegmentationObjective<const D: usize> {
    pub(super) grid: Grid<D>,
    pub(super) law: AmbrosioTortorelli,
    /// The image `u0`.
    pub(super) image: Vec<f64>,
    /// Conjugate-gradient iterations for `u` and for `v`.
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
    /// Alternates between both systems the given number of times.
    fn alternate(&mut self, x: &mut [f64], times: usize) -> Result<(), PhaseFieldError> {
        for _ in 0..times {
            self.relax(x, Part::PhaseField)?;
            self.relax(x, Part::Image)?;
        }
        Ok(())
    }

    /// Replaces a state by the better of two starts: the given one, and the one obtained with
    /// reduced costs of edges, which increase step by step. In a smooth image a jump must be higher
    /// to become an edge than to remain one, and an edge hidden by noise in part is found by the
    /// second start only.
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

    /// What the checkpoints keep beside the fields.
    fn counts(&self) -> Vec<f64> {
        self.system_iterations.map(|count| count as f64).to_vec()
    }

    /// Takes over what [`Self::counts`] has returned.
    fn restore(&mut self, counts: &[f64]) {
        for (own, count) in self.system_iterations.iter_mut().zip(counts) {
            *own = *count as usize;
        }
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

/// Alternating solution for the phase field and for the image, in this order: the image of a
/// coarser level is smooth, and the phase field depends on its edges only. In the opposite order
/// the wide edges of the coarser level would admit the noise of the finer one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alternation {
    /// Relative tolerance: ends when an alternation decreases the energy by less than this
    /// fraction.
    pub tolerance: f64,
    /// Maximal number of alternations.
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
        let mut last = Vec::new();
        let mut ended = None;
        let memory = observer.resume();
        if let Some(memory) = memory.filter(|memory| memory.fits(x.len(), 0)) {
            x.copy_from_slice(&memory.x);
            energies.extend_from_slice(&memory.energies);
            evaluations = memory.evaluations;
            objective.restore(&memory.objective);
            ended = memory.ended.map(|ended| ended.status);
            if ended.is_none() {
                last = memory.gradient.into_owned();
            }
        } else {
            objective.better_start(x)?;
            last = x.to_vec();
        }
        let resumed = ended.is_some();
        let status = loop {
            if let Some(status) = ended {
                break status;
            }
            if !energies.is_empty() {
                observer.memory(&Memory {
                    // In the place of a gradient, which it has not: the state before.
                    gradient: (&last[..]).into(),
                    energies: (&energies[..]).into(),
                    evaluations,
                    ended: None,
                    ..Memory::of_result(x, objective.counts())
                });
            }
            // The relaxation returns the energy before it: the next state is computed ahead, and
            // discarded if the last one satisfies the tolerance.
            let mut next = x.to_vec();
            let energy = objective.relax(&mut next, Part::PhaseField)?;
            evaluations.gradients += 1;
            // At the minimum a step consists of rounding errors.
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
        if !resumed && status != Status::Cancelled {
            observer.memory(&Memory {
                energies: (&energies[..]).into(),
                evaluations,
                ended: Some(Ended {
                    status,
                    gradient_norm: 0.0,
                }),
                ..Memory::of_result(x, objective.counts())
            });
        }
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
