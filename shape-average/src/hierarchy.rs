//! The levels of an average, from coarse to fine, and their stopping criteria.

use crate::alternating::Alternating;
use crate::confirm::minimise_in_rounds;
use crate::energy::Energy;
use crate::error::AverageError;
use crate::level::LevelShapes;
use crate::objective::AverageObjective;
use crate::params::{AverageParams, Precision, Solver};
use crate::reached::Reached;
use crate::result::{LevelReport, worst_of_all};
use crate::second::{SecondDeformations, minimise_again};
use crate::shapes::Shapes;
use fe_grid::minimise::{
    Info, LbfgsParams, LevelProblem, Minimiser, Observer, Stopping, minimise_levels,
};
use fe_grid::transfer::{inject_into, prolong_into};
use fe_grid::vector::round_to;
use fe_grid::{Buffer, Distribution, Field, Grid, mutant, parallel, repair};

/// Number of iterations over which the decrease of the energy is measured.
const ENERGY_WINDOW: usize = 5;
/// A level ends when the predicted decrease is below this fraction of the tolerance: levels that
/// need no correction then take no steps, and equal shapes are not moved at all.
const DECREMENT: f64 = 0.2;
/// Factor of the tolerance on the coarser levels. Their iterations cost little, and where a fine level
/// ends depends on where it starts: the jumps of its discrete mismatch hold it back.
const COARSE: f64 = 0.3;
/// Number of pairs in the L-BFGS history. The metric contains most of the curvature, and the pairs
/// dominate the memory (five are as good as thirty on hands and stars).
pub(crate) const HISTORY: usize = 5;
/// Number of iterations after which the metric is recomputed.
pub(crate) const METRIC_INTERVAL: usize = 8;

/// The least curvature of a pair where the average is prescribed, as a share of what was expected. The mismatch with an
/// average that does not follow has many bumps. Without a bound hippocampi took 3 evaluations an iteration at 33^3
/// nodes and 10 at 65^3, and with this one 1.3 and 2.3; with 0.3 they take more iterations. An upper bound does harm:
/// pairs of much curvature hold steps back between bumps.
const LEAST_SHARE: f64 = 0.1;

/// Minimises on all levels.
pub(crate) fn solve_levels<const D: usize>(
    mut problem: Levels<'_, D>,
    observer: &mut dyn Observer,
) -> Result<Reached<D>, AverageError> {
    let params = problem.params;
    let dim = D * problem.grids[0].n_nodes();
    let mut first = params.storage.zeros(dim * problem.n_own)?;
    for (x, u) in first.chunks_exact_mut(dim).zip(&problem.start) {
        x.copy_from_slice(u);
    }
    let (finest, estimated) = (problem.grids.len() - 1, problem.estimated);
    let second = problem.second;
    let onto = estimated && problem.targets.is_some();
    let minimiser = |level| LevelMinimiser {
        params: params.clone(),
        finest: level == finest,
        estimated,
        onto,
        second: second.filter(|_| level + 1 == finest),
    };
    let solution = minimise_levels(&mut problem, minimiser, first, observer)?;
    for (report, level) in problem.reports.iter_mut().zip(&solution.levels) {
        report.seconds = level.seconds;
    }
    problem.into_reached(solution.x)
}

/// The minimiser selected by the parameters, with the stopping criterion of a level.
pub(crate) struct LevelMinimiser<'a, const D: usize> {
    pub params: AverageParams,
    /// Whether the level is the finest one.
    pub finest: bool,
    /// Whether the remaining energy is estimated on the finest level.
    pub estimated: bool,
    /// Whether a result is a deformation onto a prescribed average.
    pub onto: bool,
    /// The second deformations of this level, if there are any.
    pub second: Option<&'a dyn SecondDeformations<D>>,
}

impl<const D: usize> LevelMinimiser<'_, D> {
    /// Returns a factor of the tolerance: the least weight relative to equal weights, at least 0.1.
    /// A shape of small weight contributes little to the energy.
    fn strictness(&self, n_shapes: usize) -> f64 {
        let weights = self.params.resolved_weights(n_shapes);
        let least = weights.into_iter().fold(f64::INFINITY, f64::min);
        (n_shapes as f64 * least).clamp(0.1, 1.0)
    }
}

impl<const D: usize> Minimiser<AverageObjective<D>> for LevelMinimiser<'_, D> {
    fn minimise(
        &self,
        objective: &mut AverageObjective<D>,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Info, AverageError> {
        let factor = if self.finest { 1.0 } else { COARSE };
        let strictness = self.strictness(objective.shapes().n_shapes());
        let tolerance = factor * strictness * self.params.tolerance;
        let precision = self.params.precision_on(objective.grid());
        match self.params.solver {
            Solver::Lbfgs => {
                let stopping = Stopping {
                    relative_gradient: 0.0,
                    relative_decrement: DECREMENT * tolerance,
                    absolute_decrement: 0.0,
                    relative_energy: tolerance,
                    energy_window: ENERGY_WINDOW,
                    max_iterations: self.params.max_iterations,
                };
                let lbfgs = LbfgsParams {
                    least_share: if self.onto { LEAST_SHARE } else { 0.0 },
                    metric_interval: METRIC_INTERVAL,
                    history: HISTORY,
                    compact: precision == Precision::Mixed,
                    stopping,
                    ..LbfgsParams::default()
                };
                if self.finest && self.estimated {
                    minimise_in_rounds(&lbfgs, objective, x, observer)
                } else if let Some(second) = self.second {
                    minimise_again(&lbfgs, objective, x, second, observer)
                } else {
                    lbfgs.minimise(objective, x, observer)
                }
            }
            Solver::Descent => Alternating {
                max_iterations: self.params.max_iterations,
                tolerance,
                target: None,
            }
            .minimise(objective, x, observer),
        }
    }
}

/// Computes the phase fields of a shape on all levels, coarsest first, as targets for other shapes: on
/// every level those of all components, one after the other.
pub(crate) fn targets_of<const D: usize>(
    target: Shapes<'_, D>,
    params: &AverageParams,
) -> Result<Vec<Vec<f64>>, AverageError> {
    let levels = levels_of(target, params)?.into_iter();
    let of_level = |level: LevelShapes<D>| {
        let fields: Vec<_> = level
            .phase_fields
            .into_iter()
            .map(Field::into_vec)
            .collect();
        fields.concat()
    };
    Ok(levels.map(of_level).collect())
}

/// The levels of an average.
pub(crate) struct Levels<'a, const D: usize> {
    params: &'a AverageParams,
    /// The prescribed average on every level, if any.
    targets: Option<Vec<Vec<f64>>>,
    /// Additional factor of the terms of each shape; `None` if all are one.
    shares: Option<Vec<f64>>,
    /// Initial displacements of the shapes of this process on the coarsest level; empty if they are zero.
    start: Vec<&'a [f64]>,
    /// Whether the remaining energy is estimated on the finest level.
    estimated: bool,
    /// The second deformations of the second finest level, if there are any.
    second: Option<&'a dyn SecondDeformations<D>>,
    /// Grids, coarsest first.
    grids: Vec<Grid<D>>,
    /// Numbers of shapes of all processes, and of this one.
    n_shapes: usize,
    n_own: usize,
    shapes: Vec<Option<LevelShapes<D>>>,
    average: Vec<f64>,
    pub(crate) reports: Vec<LevelReport>,
    finest: Option<LevelShapes<D>>,
}

impl<'a, const D: usize> Levels<'a, D> {
    pub(crate) fn new(levels: Vec<LevelShapes<D>>, params: &'a AverageParams) -> Self {
        let grids: Vec<Grid<D>> = levels.iter().map(|level| *level.grid()).collect();
        Self {
            params,
            targets: None,
            shares: None,
            start: Vec::new(),
            n_shapes: levels[0].n_shapes(),
            n_own: levels[0].n_own(),
            estimated: false,
            second: None,
            average: vec![1.0; levels[0].n_components() * grids[0].n_nodes()],
            grids,
            shapes: levels.into_iter().map(Some).collect(),
            reports: Vec::new(),
            finest: None,
        }
    }

    /// Prescribes the average on every level.
    pub(crate) fn onto(self, targets: Vec<Vec<f64>>) -> Self {
        Self {
            targets: Some(targets),
            ..self
        }
    }

    /// Multiplies the terms of every shape by its share.
    pub(crate) fn shared(self, shares: Vec<f64>) -> Self {
        Self {
            shares: Some(shares),
            ..self
        }
    }

    /// Minimises on the finest level until the estimate of the remaining energy is small.
    pub(crate) fn estimated(self) -> Self {
        Self {
            estimated: true,
            ..self
        }
    }

    /// Minimises again on the second finest level, from these deformations.
    pub(crate) fn again(self, second: &'a dyn SecondDeformations<D>) -> Self {
        Self {
            second: Some(second),
            ..self
        }
    }

    /// Starts from these displacements of the shapes of this process on the coarsest level, if there are
    /// any.
    pub(crate) fn from(self, start: Vec<&'a [f64]>) -> Self {
        Self { start, ..self }
    }

    fn into_reached(self, x: Buffer<f64>) -> Result<Reached<D>, AverageError> {
        // The level on which the run was cancelled is the last.
        let shapes = self.finest.ok_or(AverageError::NoShapes)?;
        let mut votes = self.params.resolved_weights(self.n_shapes);
        if let Some(shares) = &self.shares {
            for (vote, share) in votes.iter_mut().zip(shares) {
                *vote *= share;
            }
            let sum: f64 = votes.iter().sum();
            for vote in &mut votes {
                *vote /= sum;
            }
        }
        Ok(Reached {
            shapes,
            x,
            average: self.average,
            reports: self.reports,
            votes,
        })
    }
}

/// Computes the shapes on all levels, coarsest first.
pub(crate) fn levels_of<const D: usize>(
    shapes: Shapes<'_, D>,
    params: &AverageParams,
) -> Result<Vec<LevelShapes<D>>, AverageError> {
    let alone = Distribution::alone(shapes.len());
    levels_of_visible(shapes, &[], params, &alone)
}

/// Computes the shapes of this process, of all those given, with their visibility masks on all levels,
/// coarsest first.
pub(crate) fn levels_of_visible<const D: usize>(
    shapes: Shapes<'_, D>,
    seen: &[Field<f64, D, 1>],
    params: &AverageParams,
    distribution: &Distribution,
) -> Result<Vec<LevelShapes<D>>, AverageError> {
    let grids = shapes.whole()[0].grid().hierarchy(params.coarsest_nodes);
    let mut levels = Vec::with_capacity(grids.len());
    let own = distribution.own();
    let mut distances = shapes.select(own.clone(), Field::clone);
    let mut seen = seen.get(own).unwrap_or_default().to_vec();
    for (depth, grid) in grids.iter().enumerate().rev() {
        if depth + 1 < grids.len() {
            // Nodes of a coarse grid are nodes of the fine one, so the distances there are exact.
            distances.change(|u| inject(grid, u));
            seen = seen.iter().map(|w| inject(grid, w)).collect();
        }
        let level = LevelShapes::of_shapes(*grid, distances.as_shapes(), params)?;
        let level = level.with_visibility(seen.clone());
        levels.push(level.distributed(distribution.clone()));
    }
    levels.reverse();
    Ok(levels)
}

pub(crate) fn inject<const D: usize>(grid: &Grid<D>, fine: &Field<f64, D, 1>) -> Field<f64, D, 1> {
    let mut coarse = Field::zeros(*grid);
    inject_into(grid, fine.as_slice(), coarse.as_mut_slice());
    coarse
}

impl<const D: usize> LevelProblem for Levels<'_, D> {
    type Error = AverageError;
    type Objective = AverageObjective<D>;

    fn n_levels(&self) -> usize {
        self.grids.len()
    }

    fn objective(&mut self, level: usize) -> Result<AverageObjective<D>, AverageError> {
        let shapes = self.shapes[level].take().ok_or(AverageError::NoShapes)?;
        if let Some(targets) = &self.targets {
            let target = targets[level].clone();
            return Ok(AverageObjective::onto(shapes, self.params, target)?);
        }
        let average = std::mem::take(&mut self.average);
        let objective = AverageObjective::new(shapes, self.params, average)?;
        Ok(match &self.shares {
            Some(shares) => objective.with_shares(shares),
            None => objective,
        })
    }

    fn prolong(&mut self, level: usize, x: &[f64]) -> Result<Buffer<f64>, AverageError> {
        let (coarse, fine) = (&self.grids[level], &self.grids[level + 1]);
        let dim = D * coarse.n_nodes();
        let size = x.len() / dim * D * fine.n_nodes();
        let mut finer = self.params.storage.zeros(size)?;
        let parts = finer.chunks_exact_mut(D * fine.n_nodes());
        parallel::for_each(parts.zip(x.chunks_exact(dim)), &|(finer, x)| {
            mutant!(prolong_into(coarse, x, finer), CascadeForgotten => finer.fill(0.0));
        });
        if self.targets.is_none() {
            let averages = self.average.chunks_exact(coarse.n_nodes());
            let mut finer = vec![0.0; averages.len() * fine.n_nodes()];
            for (average, finer) in averages.zip(finer.chunks_exact_mut(fine.n_nodes())) {
                prolong_into(coarse, average, finer);
            }
            self.average = finer;
        }
        Ok(finer)
    }

    /// Makes a state admissible. Prolongation to a nested space does not change the determinant;
    /// any other state is interpolated towards the identity, shape by shape, until it is
    /// admissible.
    fn repair(&mut self, level: usize, x: &mut [f64]) -> Result<(), AverageError> {
        let grid = &self.grids[level];
        let bound = self.params.min_determinant;
        if self.params.precision_on(grid) == Precision::Mixed {
            // What the minimiser rounds the state to.
            round_to::<f32>(x);
        }
        parallel::for_each(x.chunks_exact_mut(D * grid.n_nodes()), &|u| {
            repair(grid, u, bound, None);
        });
        Ok(())
    }

    fn finish_level(
        &mut self,
        _level: usize,
        objective: AverageObjective<D>,
        x: &[f64],
        info: &Info,
    ) -> Result<(), AverageError> {
        let mut objective = objective;
        // The last evaluation may have been that of a rejected trial.
        let energy = match objective.evaluate_energy(x)? {
            fe_grid::minimise::Evaluation::Value(_) => objective.energy().clone(),
            fe_grid::minimise::Evaluation::Inadmissible => Energy::default(),
        };
        let grid = *objective.grid();
        self.reports.push(LevelReport {
            nodes: grid.nodes_per_axis().to_vec(),
            interface_width: objective.shapes().interface_width(),
            status: info.status,
            iterations: info.iterations,
            evaluations: info.evaluations,
            shape_evaluations: objective.shape_evaluations - objective.shapes().n_shapes(),
            average_iterations: objective.average_iterations,
            rematched: std::mem::take(&mut objective.rematched),
            energies: info.energies.clone(),
            energy,
            certificate: worst_of_all(objective.grid(), x, objective.shapes().distribution()),
            seconds: 0.0,
        });
        self.average = objective.average().to_vec();
        if let Some(report) = self.reports.last_mut() {
            report.energy.remaining = objective.found_remaining;
        }
        self.finest = Some(objective.into_shapes());
        Ok(())
    }
}
