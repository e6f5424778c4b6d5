//! The state on one level, and the two halves of a round.

use super::density::JointDensity;
use super::params::{Edges, JointParams};
use super::result::JointEnergy;
use crate::energy::Energy;
use crate::error::AverageError;
use crate::hierarchy::{HISTORY, METRIC_INTERVAL};
use crate::level::LevelShapes;
use crate::level::shape;
use crate::objective::AverageObjective;
use crate::params::{AverageParams, Mean};
use crate::quiet::Quiet;
use fe_grid::composition::{Interpolant, Matching};
use fe_grid::minimise::{
    Ended, Evaluation, LbfgsParams, Memory, Minimiser, Objective, Observer, Status, Stopping,
};
use fe_grid::transfer::prolong_into;
use fe_grid::{Assembly, Data, Distribution, Field, Grid, ScalarField, parallel};
use phasefield::Mismatch;
use phasefield::segmentation::{AmbrosioTortorelli, Part, SegmentationEnergy, relax};

/// A half of a round ends when the predicted decrease is below this fraction of the energy.
const DECREMENT: f64 = 1e-5;

/// Number of alternating solves for an image and its phase field from the edges of the average,
/// before the result is compared with the present pair.
const TRIAL: usize = 2;

/// The state on one level, with the images of this process.
pub(super) struct State<const D: usize> {
    pub grid: Grid<D>,
    /// Which of all images they are.
    pub distribution: Distribution,
    /// The images `u_i0`.
    pub images: Vec<ScalarField<f64, D>>,
    /// `u_i`, then `v_i`, of every image.
    pub pairs: Vec<Vec<f64>>,
    /// Displacements of all images, one after the other.
    pub displacements: Vec<f64>,
    pub average: Vec<f64>,
    pub energy: Energy,
    pub work: Work,
}

/// Work counters of a level.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Work {
    /// Number of accepted steps of the minimiser of averages.
    pub steps: usize,
    /// Conjugate-gradient iterations of all systems for images and for phase fields, of all processes.
    pub system_iterations: [usize; 2],
}

/// The rounds that have been performed on a level.
#[derive(Debug, Default)]
pub(super) struct Rounds {
    /// The energies after every half.
    pub energies: Vec<f64>,
    pub count: usize,
    /// The status, where there are no more.
    pub ended: Option<Status>,
}

/// Numbers of a [`Memory`] that are not values of fields, without the elastic energies and the mismatches.
const N_NUMBERS: usize = 10;

impl<const D: usize> State<D> {
    /// The memory after a round: the displacement, the image and the phase field of every image, the average and
    /// the terms of the energy.
    pub fn remember(
        &self,
        energies: &[f64],
        rounds: usize,
        ended: Option<Status>,
        observer: &mut dyn Observer,
    ) {
        let (energy, work) = (&self.energy, &self.work);
        let [images, phase_fields] = work.system_iterations;
        let counts = [rounds, work.steps, images, phase_fields].map(|count| count as f64);
        let terms = [energy.total, energy.length, energy.barrier];
        let numbers = counts.iter().chain(&terms).chain(&energy.parts);
        let of_shapes = energy.elastic.iter().chain(&energy.mismatch);
        let numbers = numbers.chain(of_shapes).chain(&self.average);
        let dim = D * self.grid.n_nodes();
        let parts = self.displacements.chunks_exact(dim).zip(&self.pairs);
        let x: Vec<f64> = parts.flat_map(|(u, pair)| [u, pair].concat()).collect();
        observer.memory(&Memory {
            energies: energies.into(),
            ended: ended.map(|status| Ended {
                status,
                gradient_norm: 0.0,
            }),
            ..Memory::of_result(&x, numbers.copied().collect())
        });
    }

    /// The inverse; `None` for a memory of something else, which changes nothing.
    pub fn restore(&mut self, memory: &Memory<'_>) -> Option<Rounds> {
        let (n, nodes) = (self.distribution.n_parts(), self.grid.n_nodes());
        let dim = D * nodes;
        let fits = memory.x.len() == self.images.len() * (dim + 2 * nodes)
            && memory.objective.len() == N_NUMBERS + 2 * n + nodes;
        // All processes go on together.
        if !self.distribution.all(fits) {
            return None;
        }
        let (numbers, rest) = memory.objective.split_first_chunk::<N_NUMBERS>()?;
        let [
            rounds,
            steps,
            images,
            phase_fields,
            total,
            length,
            barrier,
            parts @ ..,
        ] = *numbers;
        let (elastic, rest) = rest.split_at(n);
        let (mismatch, average) = rest.split_at(n);
        self.average.copy_from_slice(average);
        let shapes = memory.x.chunks_exact(dim + 2 * nodes);
        let (displacements, pairs): (Vec<_>, Vec<_>) = shapes.map(|x| x.split_at(dim)).unzip();
        self.displacements = displacements.concat();
        self.pairs = pairs.into_iter().map(<[f64]>::to_vec).collect();
        self.energy = Energy {
            total,
            parts,
            elastic: elastic.to_vec(),
            mismatch: mismatch.to_vec(),
            length,
            components: Vec::new(),
            barrier,
            remaining: None,
        };
        self.work = Work {
            steps: steps as usize,
            system_iterations: [images, phase_fields].map(|count| count as usize),
        };
        Some(Rounds {
            energies: memory.energies.to_vec(),
            count: rounds as usize,
            ended: memory.ended.map(|ended| ended.status),
        })
    }

    /// Creates the state of images that are not segmented yet, with zero displacements.
    pub fn new(
        grid: Grid<D>,
        images: Vec<ScalarField<f64, D>>,
        distribution: &Distribution,
    ) -> Self {
        Self {
            displacements: vec![0.0; D * grid.n_nodes() * images.len()],
            average: vec![1.0; grid.n_nodes()],
            energy: Energy::default(),
            work: Work::default(),
            distribution: distribution.clone(),
            grid,
            pairs: vec![Vec::new(); images.len()],
            images,
        }
    }

    /// Sets the initial deformations, if there are any.
    pub fn start_from(&mut self, known: &[Field<f64, D, D>]) {
        let own = self.displacements.chunks_exact_mut(D * self.grid.n_nodes());
        for (own, known) in own.zip(known) {
            own.copy_from_slice(known.as_slice());
        }
    }

    /// Takes over the deformations and the average from the next coarser level.
    pub fn take_deformations(&mut self, coarse: &Self) {
        let (dim, fine) = (D * coarse.grid.n_nodes(), D * self.grid.n_nodes());
        let finer = self.displacements.chunks_exact_mut(fine);
        for (finer, u) in finer.zip(coarse.displacements.chunks_exact(dim)) {
            prolong_into(&coarse.grid, u, finer);
        }
        prolong_into(&coarse.grid, &coarse.average, &mut self.average);
    }

    fn law(&self, params: &JointParams) -> AmbrosioTortorelli {
        let width = self.interface_width(params);
        AmbrosioTortorelli {
            weights: params.segmentation.weights,
            interface_width: width,
            edge_conductance: params.segmentation.edge_conductance * width * width,
        }
    }

    pub fn interface_width(&self, params: &JointParams) -> f64 {
        params.average.interface_cells * self.grid.spacing()
    }

    /// First half of a round: at most the given number of steps for the deformations, with the
    /// phase fields fixed.
    pub fn deform(
        &mut self,
        params: &JointParams,
        observer: &mut dyn Observer,
    ) -> Result<Status, AverageError> {
        let n = self.images.len();
        let average_params = AverageParams {
            // The object is the whole box.
            void_stiffness: 1.0,
            weights: None,
            mean: Mean::Arithmetic,
            ..params.average.clone()
        };
        let phase_fields: Result<Vec<_>, _> = self
            .pairs
            .iter()
            .map(|pair| Field::from_vec(self.grid, pair[self.grid.n_nodes()..].to_vec()))
            .collect();
        let everywhere = Field::from_fn(self.grid, |_| [1.0]);
        let shapes = LevelShapes::from_fields(
            self.grid,
            self.interface_width(params),
            phase_fields?,
            vec![everywhere; n],
        )
        .distributed(self.distribution.clone());
        let average = std::mem::take(&mut self.average);
        let mut objective = AverageObjective::new(shapes, &average_params, average)?;
        let minimiser = LbfgsParams {
            metric_interval: METRIC_INTERVAL,
            history: HISTORY,
            stopping: Stopping {
                relative_gradient: 0.0,
                relative_decrement: DECREMENT,
                energy_window: 0,
                max_iterations: params.steps,
                ..Stopping::default()
            },
            ..LbfgsParams::default()
        };
        let x = &mut self.displacements;
        let info = minimiser.minimise(&mut objective, x, &mut Quiet(observer))?;
        self.work.steps += info.iterations;
        // The last evaluation may have been that of a rejected trial.
        if let Evaluation::Value(_) = objective.value(x)? {
            self.energy = objective.energy().clone();
        }
        self.average = objective.average().to_vec();
        Ok(info.status)
    }

    /// Second half of a round: solves for the phase field and the image of every input, with the
    /// average and the deformations fixed.
    pub fn segment(&mut self, params: &JointParams) -> Result<(), AverageError> {
        let (law, grid) = (self.law(params), self.grid);
        let density = JointDensity {
            segmentation: law,
            mismatch: Mismatch {
                interface_width: law.interface_width,
                scale: params.average.mismatch_weight,
            },
            average: Interpolant::new(grid, &self.average),
        };
        let n = grid.n_nodes();
        let average = ScalarField::from_vec(grid, self.average.clone())?;
        let (images, displacements) = (&self.images, &self.displacements);
        let pairs = self.pairs.iter_mut().enumerate();
        let solved: Result<Vec<[usize; 2]>, AverageError> =
            parallel::try_map(pairs, &|(i, pair)| {
                let displacement = shape(displacements, i, D * n);
                let mut coefficients = vec![images[i].as_slice()];
                coefficients.extend(displacement.chunks_exact(n));
                let data = Data {
                    coefficients: &coefficients,
                    cells: &[],
                };
                let mut work = [0; 2];
                let mut solve = |pair: &mut [f64], part| -> Result<(), AverageError> {
                    let done = relax(&grid, &density, data, pair, part)?;
                    work[part as usize] += done.iterations;
                    Ok(())
                };
                solve(pair, Part::PhaseField)?;
                solve(pair, Part::Image)?;
                // Edges found in the other images may also be present here although the present
                // state is a local minimum without them: the second start is used if it decreases
                // the energy.
                let mut told = pair.clone();
                told[n..].copy_from_slice(average.compose(displacement).as_slice());
                solve(&mut told, Part::Image)?;
                for _ in 0..TRIAL {
                    solve(&mut told, Part::PhaseField)?;
                    solve(&mut told, Part::Image)?;
                }
                let share = Assembly::new(grid, &density, data);
                if share.value(&told)? < share.value(pair)? {
                    *pair = told;
                }
                Ok(work)
            });
        let mut iterations = [0.0; 2];
        for own in solved? {
            for (sum, more) in iterations.iter_mut().zip(own) {
                *sum += more as f64;
            }
        }
        self.distribution.communicator().sum(&mut iterations);
        for (sum, more) in self.work.system_iterations.iter_mut().zip(iterations) {
            *sum += more as usize;
        }
        Ok(())
    }

    /// Computes the terms of the energy of the present state. Collective.
    pub fn evaluate(&self, params: &JointParams) -> Result<JointEnergy, AverageError> {
        let (law, n) = (self.law(params), self.distribution.n_parts() as f64);
        let held = params.edges != Edges::Together;
        let terms = |i: usize| -> Result<[f64; 5], AverageError> {
            let image = if held {
                SegmentationEnergy::default()
            } else {
                law.terms(&self.grid, self.images[i].as_slice(), &self.pairs[i])?
            };
            Ok([
                self.mismatch(params, i)?,
                image.total,
                image.fidelity,
                image.smoothness,
                image.edges,
            ])
        };
        let own: Result<Vec<_>, _> = (0..self.images.len()).map(terms).collect();
        let mut shapes = self.energy.clone();
        shapes.mismatch.clear();
        let mut images = Vec::new();
        for [mismatch, total, fidelity, smoothness, edges] in self.distribution.share(&own?) {
            shapes.mismatch.push(mismatch);
            images.push(SegmentationEnergy {
                total,
                fidelity,
                smoothness,
                edges,
            });
        }
        let of_images: f64 = images.iter().map(|image| image.total).sum::<f64>() / n;
        let sum = |terms: &[f64]| terms.iter().sum::<f64>() / n;
        shapes.total = sum(&shapes.elastic)
            + params.average.mismatch_weight * sum(&shapes.mismatch)
            + params.average.resolved_length_weight() * shapes.length;
        Ok(JointEnergy {
            total: shapes.total + of_images,
            shapes,
            images,
            remaining: None,
        })
    }

    /// Computes the mismatch between one image's phase field and the average; only this phase field
    /// has changed since the last deformation half.
    fn mismatch(&self, params: &JointParams, i: usize) -> Result<f64, AverageError> {
        let density = Mismatch {
            interface_width: self.interface_width(params),
            scale: 1.0,
        };
        let average = Interpolant::new(self.grid, &self.average);
        let law = Matching::new(density, average);
        let coefficients = [&self.pairs[i][self.grid.n_nodes()..]];
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let dim = D * self.grid.n_nodes();
        let assembly = Assembly::new(self.grid, &law, data);
        Ok(assembly.value(shape(&self.displacements, i, dim))?)
    }
}
