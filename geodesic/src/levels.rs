//! Minimisation from level to level, for both forms of paths.

use crate::descent::minimiser;
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::params::GeodesicParams;
use fe_grid::minimise::{
    Control, Info, Iteration, LevelProblem, Objective, Observer, Status, minimise_levels,
};
use fe_grid::{Buffer, Grid};
use serde::Serialize;

/// Convergence history of one level.
#[derive(Clone, Debug, Serialize)]
pub struct LevelReport {
    /// Nodes along each axis, `x` first.
    pub nodes: Vec<usize>,
    /// Number of steps of the path.
    pub steps: usize,
    /// Record of the minimiser.
    #[serde(flatten)]
    pub info: Info,
    /// Terms of the energy at the end.
    #[serde(flatten)]
    pub energy: PathEnergy,
}

/// A level of a path: a grid and a number of steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Level<const D: usize> {
    pub grid: Grid<D>,
    pub steps: usize,
    /// Factor of the tolerance.
    pub tolerance: f64,
}

/// A path on a level, as the vector of its unknowns.
pub(crate) struct PathOnLevel<const D: usize> {
    pub level: Level<D>,
    pub x: Buffer<f64>,
    /// Its energy; infinite if it is not known.
    pub total: f64,
}

impl<const D: usize> PathOnLevel<D> {
    /// Wraps a path that has not been minimised.
    pub fn new(level: Level<D>, x: Vec<f64>) -> Self {
        Self {
            level,
            x: x.into(),
            total: f64::INFINITY,
        }
    }
}

/// The energy of a path on one level.
pub(crate) trait PathTerms: Objective<Error = GeodesicError> {
    /// Returns the terms of the last evaluation.
    fn terms(&self) -> &PathEnergy;

    /// Makes a state admissible.
    fn repair(&self, x: &mut [f64]);
}

/// A form of paths between two shapes.
pub(crate) trait PathForm<const D: usize> {
    type Objective: PathTerms;

    /// Creates the energy of a level, with the parameters of that level.
    fn objective(
        &self,
        level: &Level<D>,
        params: &GeodesicParams,
    ) -> Result<Self::Objective, GeodesicError>;

    /// Transfers a path to a level with another grid or with another number of steps.
    fn transfer(
        &self,
        x: &[f64],
        from: &Level<D>,
        to: &Level<D>,
    ) -> Result<Vec<f64>, GeodesicError>;

    /// Sets the unknowns that are fixed on a level.
    fn fix(&self, _level: &Level<D>, _x: &mut [f64]) {}
}

/// The minimisation of paths in one form, over one or several sequences of levels.
pub(crate) struct Descent<'a, F, const D: usize> {
    pub form: F,
    params: &'a GeodesicParams,
    pub observer: &'a mut dyn Observer,
    /// Number of levels of all sequences.
    pub n_levels: usize,
    /// Convergence history of each level, in order.
    pub reports: Vec<LevelReport>,
}

impl<'a, F: PathForm<D>, const D: usize> Descent<'a, F, D> {
    pub fn new(
        form: F,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
        n_levels: usize,
    ) -> Self {
        Self {
            form,
            params,
            observer,
            n_levels,
            reports: Vec::new(),
        }
    }

    /// Returns whether the last level ended the minimisation.
    pub fn ended(&self) -> bool {
        let status = self.reports.last().map(|report| report.info.status);
        matches!(status, Some(Status::Cancelled | Status::InadmissibleStart))
    }

    /// Minimises on a sequence of levels, starting with a path on the first of them or on the level
    /// before it; returns the path on the last level that was reached.
    pub fn minimise(
        &mut self,
        start: PathOnLevel<D>,
        levels: &[Level<D>],
    ) -> Result<PathOnLevel<D>, GeodesicError> {
        if levels.is_empty() || self.ended() {
            return Ok(start);
        }
        let mut observer = Numbered {
            first: self.reports.len(),
            n_levels: self.n_levels,
            observer: self.observer,
        };
        let params = self.params;
        let mut sequence = Sequence {
            form: &self.form,
            params,
            levels,
            reports: &mut self.reports,
        };
        let x = sequence.carried(start.x, &start.level, &levels[0])?;
        let minimiser = |level: usize| minimiser(&params_on(params, &levels[level]));
        let found = minimise_levels(&mut sequence, minimiser, x, &mut observer)?;
        let reached = levels[found.levels.len() - 1];
        let energy = self.reports.last().map(|report| report.energy.total);
        Ok(PathOnLevel {
            level: reached,
            x: found.x,
            total: energy.unwrap_or(f64::INFINITY),
        })
    }
}

/// Returns the parameters of a level.
fn params_on<const D: usize>(params: &GeodesicParams, level: &Level<D>) -> GeodesicParams {
    GeodesicParams {
        steps: level.steps,
        tolerance: level.tolerance * params.tolerance,
        ..params.clone()
    }
}

/// A sequence of levels.
struct Sequence<'a, F, const D: usize> {
    form: &'a F,
    params: &'a GeodesicParams,
    levels: &'a [Level<D>],
    reports: &'a mut Vec<LevelReport>,
}

impl<F: PathForm<D>, const D: usize> Sequence<'_, F, D> {
    fn carried(
        &self,
        x: Buffer<f64>,
        from: &Level<D>,
        to: &Level<D>,
    ) -> Result<Buffer<f64>, GeodesicError> {
        if from.grid == to.grid && from.steps == to.steps {
            return Ok(x);
        }
        Ok(self.form.transfer(&x, from, to)?.into())
    }
}

impl<F: PathForm<D>, const D: usize> LevelProblem for Sequence<'_, F, D> {
    type Error = GeodesicError;
    type Objective = F::Objective;

    fn n_levels(&self) -> usize {
        self.levels.len()
    }

    fn objective(&mut self, level: usize) -> Result<F::Objective, GeodesicError> {
        let level = &self.levels[level];
        self.form.objective(level, &params_on(self.params, level))
    }

    fn prolong(&mut self, level: usize, x: &[f64]) -> Result<Buffer<f64>, GeodesicError> {
        let (from, to) = (&self.levels[level], &self.levels[level + 1]);
        Ok(self.form.transfer(x, from, to)?.into())
    }

    fn repair(&mut self, level: usize, x: &mut [f64]) -> Result<(), GeodesicError> {
        self.form.fix(&self.levels[level], x);
        self.objective(level)?.repair(x);
        Ok(())
    }

    fn finish_level(
        &mut self,
        level: usize,
        mut objective: F::Objective,
        x: &[f64],
        info: &Info,
    ) -> Result<(), GeodesicError> {
        // The last evaluation may have been that of a rejected trial.
        objective.value(x)?;
        let Level { grid, steps, .. } = &self.levels[level];
        self.reports.push(LevelReport {
            nodes: grid.nodes_per_axis().to_vec(),
            steps: *steps,
            info: info.clone(),
            energy: objective.terms().clone(),
        });
        Ok(())
    }
}

/// An observer of one of several sequences, with the numbers of all their levels.
struct Numbered<'a> {
    first: usize,
    n_levels: usize,
    observer: &'a mut dyn Observer,
}

impl Observer for Numbered<'_> {
    fn level(&mut self, level: usize, _n_levels: usize, dim: usize) {
        self.observer.level(self.first + level, self.n_levels, dim);
    }

    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        self.observer.iteration(iteration)
    }

    fn between(&mut self) -> Control {
        self.observer.between()
    }
}
