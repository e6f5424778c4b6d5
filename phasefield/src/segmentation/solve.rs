//! Solution from coarse levels to fine.

use super::alternation::{Alternation, SegmentationObjective};
use super::energy::{AmbrosioTortorelli, SegmentationEnergy};
use super::params::SegmentationParams;
use super::relax::Part;
use crate::error::PhaseFieldError;
use fe_grid::compiled_once;
use fe_grid::minimise::{Info, LevelProblem, Observer, Status, minimise_levels};
use fe_grid::transfer::{prolong_into, restrict_into};
use fe_grid::{Buffer, Field, Grid, ScalarField};
use serde::Serialize;

/// Convergence history of one level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SegmentationLevel {
    /// Nodes along each axis, `x` first.
    pub nodes: Vec<usize>,
    /// Interface width `eps`.
    pub interface_width: f64,
    /// Edge conductance `k_eps`.
    pub edge_conductance: f64,
    /// Status at the end.
    pub status: Status,
    /// Number of alternations.
    pub iterations: usize,
    /// Energy before the first and after every alternation; nonincreasing.
    pub energies: Vec<f64>,
    /// Conjugate-gradient iterations of all systems for the image, and for the phase field.
    pub system_iterations: [usize; 2],
    /// Terms of the energy at the end.
    pub energy: SegmentationEnergy,
    /// Wall time, in seconds.
    pub seconds: f64,
}

/// A segmented image.
#[derive(Clone, Debug, PartialEq)]
pub struct Segmentation<const D: usize> {
    /// The image `u`, smooth except at its edges.
    pub image: ScalarField<f64, D>,
    /// The phase field `v`: 0 on the edges, 1 away from them.
    pub phase_field: ScalarField<f64, D>,
    /// Convergence history of each level, coarsest first.
    pub levels: Vec<SegmentationLevel>,
    /// A converged status, or else the status of the first level that did not converge.
    pub status: Status,
}

impl<const D: usize> Segmentation<D> {
    /// Returns the terms of the energy on the finest level.
    pub fn energy(&self) -> SegmentationEnergy {
        self.levels.last().map(|l| l.energy).unwrap_or_default()
    }
}

compiled_once! {
    /// Computes the edges of an image.
    ///
    /// The observer is notified of every level and alternation and may cancel; the result is then
    /// the state reached so far, on the grid reached so far.
    ///
    /// # Errors
    /// [`PhaseFieldError::Parameter`], [`PhaseFieldError::NotFinite`], and [`PhaseFieldError::Grid`]
    /// if a system breaks down. Failure to converge is not an error; it is reported in the status.
    pub fn segment<'a, D>(
        image: &'a ScalarField<f64, D>,
        params: &'a SegmentationParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Segmentation<D>, PhaseFieldError> = segment_in;
}

fn segment_in<const D: usize>(
    image: &ScalarField<f64, D>,
    params: &SegmentationParams,
    observer: &mut dyn Observer,
) -> Result<Segmentation<D>, PhaseFieldError> {
    params.check()?;
    if let Some(node) = image.as_slice().iter().position(|u| !u.is_finite()) {
        return Err(PhaseFieldError::NotFinite { node });
    }
    let mut problem = Levels::new(image, *params);
    let mut start = problem.images[0].as_slice().to_vec();
    start.resize(2 * start.len(), 1.0);
    // Without edges, which are found by the first phase field, the image is smooth.
    let mut coarsest = problem.objective(0)?;
    coarsest.relax(&mut start, Part::Image)?;
    let minimiser = |_| Alternation {
        tolerance: params.tolerance,
        max_iterations: params.max_iterations,
    };
    let solution = minimise_levels(&mut problem, minimiser, start, observer)?;
    let mut levels = problem.reports;
    for (report, info) in levels.iter_mut().zip(&solution.levels) {
        report.seconds = info.seconds;
    }
    let grid = *problem.images[levels.len() - 1].grid();
    let (u, v) = solution.x.split_at(grid.n_nodes());
    let bad = levels.iter().map(|l| l.status).find(|s| !s.converged());
    Ok(Segmentation {
        image: Field::from_vec(grid, u.to_vec())?,
        phase_field: Field::from_vec(grid, v.to_vec())?,
        status: bad.unwrap_or(Status::EnergyTolerance),
        levels,
    })
}

/// Computes an image on the grid of twice the spacing: at every node the mean over the adjacent
/// fine nodes, weighted by the coarse node's shape function.
///
/// # Panics
/// If the image does not lie on the grid that halves the coarse one's spacing.
pub fn coarser_image<const D: usize>(
    coarse: &Grid<D>,
    fine: &ScalarField<f64, D>,
) -> ScalarField<f64, D> {
    let (mut sum, mut weight) = (Field::zeros(*coarse), Field::<f64, D, 1>::zeros(*coarse));
    restrict_into(coarse, fine.as_slice(), sum.as_mut_slice());
    let ones = vec![1.0; fine.as_slice().len()];
    restrict_into(coarse, &ones, weight.as_mut_slice());
    for (sum, weight) in sum.as_mut_slice().iter_mut().zip(weight.as_slice()) {
        *sum /= weight;
    }
    sum
}

struct Levels<const D: usize> {
    params: SegmentationParams,
    /// The image on every level, coarsest first.
    images: Vec<ScalarField<f64, D>>,
    reports: Vec<SegmentationLevel>,
}

impl<const D: usize> Levels<D> {
    fn new(image: &ScalarField<f64, D>, params: SegmentationParams) -> Self {
        let grids = image.grid().hierarchy(params.coarsest_nodes);
        let mut images = vec![image.clone()];
        for grid in grids.iter().rev().skip(1) {
            images.push(coarser_image(grid, &images[images.len() - 1]));
        }
        images.reverse();
        Self {
            params,
            images,
            reports: Vec::new(),
        }
    }

    fn law(&self, level: usize) -> AmbrosioTortorelli {
        let width = self.params.interface_cells * self.images[level].grid().spacing();
        AmbrosioTortorelli {
            weights: self.params.weights,
            interface_width: width,
            edge_conductance: self.params.edge_conductance * width * width,
        }
    }
}

impl<const D: usize> LevelProblem for Levels<D> {
    type Error = PhaseFieldError;
    type Objective = SegmentationObjective<D>;

    fn n_levels(&self) -> usize {
        self.images.len()
    }

    fn objective(&mut self, level: usize) -> Result<SegmentationObjective<D>, PhaseFieldError> {
        Ok(SegmentationObjective {
            grid: *self.images[level].grid(),
            law: self.law(level),
            image: self.images[level].as_slice().to_vec(),
            system_iterations: [0; 2],
        })
    }

    fn prolong(&mut self, level: usize, x: &[f64]) -> Result<Buffer<f64>, PhaseFieldError> {
        let (coarse, fine) = (self.images[level].grid(), self.images[level + 1].grid());
        let mut finer = Buffer::zeros(2 * fine.n_nodes());
        prolong_into(coarse, x, &mut finer);
        Ok(finer)
    }

    fn finish_level(
        &mut self,
        _level: usize,
        objective: SegmentationObjective<D>,
        x: &[f64],
        info: &Info,
    ) -> Result<(), PhaseFieldError> {
        let SegmentationObjective {
            grid,
            law,
            image,
            system_iterations,
        } = objective;
        self.reports.push(SegmentationLevel {
            nodes: grid.nodes_per_axis().to_vec(),
            interface_width: law.interface_width,
            edge_conductance: law.edge_conductance,
            status: info.status,
            iterations: info.iterations,
            energies: info.energies.clone(),
            system_iterations,
            energy: law.terms(&grid, &image, x)?,
            seconds: 0.0,
        });
        Ok(())
    }
}
