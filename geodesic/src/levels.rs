//! Minimisation from level to level, for both forms of paths.

use crate::descent::minimiser;
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::params::{Form, GeodesicParams};
use fe_grid::minimise::{
    Control, Info, Iteration, LevelProblem, Memory, Objective, Observer, Status, minimise_levels,
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
    /// Representation of the path: a path on the domain of a shape between both starts from one of level sets.
    pub form: Form,
    /// Weight of one mismatch.
    pub mismatch_weight: f64,
    /// Whether points were attracted to the targets of a transport, and what is stated as the mismatch is that
    /// attraction over the weight of the mismatch.
    pub targets: bool,
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
    /// Its energy; infinite if the path has not been minimised.
    pub total: f64,
}

impl<const D: usize> PathOnLevel<D> {
    pub fn new(level: Level<D>, x: Vec<f64>) -> Self {
        let (x, total) = (x.into(), f64::INFINITY);
        Self { level, x, total }
    }
}

/// A form of paths between two shapes.
pub(crate) trait PathForm<const D: usize> {
    type Objective: Objective<Error = GeodesicError>;

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

    /// Makes a path admissible on a level.
    fn repair(&self, level: &Level<D>, objective: &Self::Objective, x: &mut [f64]);

    /// Returns the terms of the last evaluation.
    fn energy(objective: &Self::Objective) -> &PathEnergy;
}

/// The minimisation of paths in one form, over one or several sequences of levels.
pub(crate) struct Descent<'a, F, const D: usize> {
    pub form: F,
    pub params: &'a GeodesicParams,
    /// Number of levels of all sequences.
    pub n_levels: usize,
    /// The present sequence.
    pub levels: Vec<Level<D>>,
    /// Convergence history of each level, in order.
    pub reports: Vec<LevelReport>,
}

impl<F: PathForm<D>, const D: usize> Descent<'_, F, D> {
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
        observer: &mut dyn Observer,
    ) -> Result<PathOnLevel<D>, GeodesicError> {
        if levels.is_empty() || self.ended() {
            return Ok(start);
        }
        let (from, to) = (&start.level, &levels[0]);
        let x = if from.grid == to.grid && from.steps == to.steps {
            start.x
        } else {
            self.form.transfer(&start.x, from, to)?.into()
        };
        self.levels = levels.to_vec();
        let minimisers: Vec<_> = levels
            .iter()
            .map(|l| minimiser(&self.params_on(l)))
            .collect();
        let mut numbered = Numbered {
            first: self.reports.len(),
            n_levels: Some(self.n_levels),
            observer,
        };
        let found = minimise_levels(self, |k: usize| minimisers[k], x, &mut numbered)?;
        let last = self.reports.last();
        Ok(PathOnLevel {
            level: levels[found.levels.len() - 1],
            x: found.x,
            total: last.map_or(f64::INFINITY, |report| report.energy.total),
        })
    }

    /// Returns the parameters of a level.
    fn params_on(&self, level: &Level<D>) -> GeodesicParams {
        GeodesicParams {
            steps: level.steps,
            tolerance: level.tolerance * self.params.tolerance,
            ..self.params.clone()
        }
    }
}

impl<F: PathForm<D>, const D: usize> LevelProblem for Descent<'_, F, D> {
    type Error = GeodesicError;
    type Objective = F::Objective;

    fn n_levels(&self) -> usize {
        self.levels.len()
    }

    fn objective(&mut self, level: usize) -> Result<F::Objective, GeodesicError> {
        let level = &self.levels[level];
        self.form.objective(level, &self.params_on(level))
    }

    fn prolong(&mut self, level: usize, x: &[f64]) -> Result<Buffer<f64>, GeodesicError> {
        let (from, to) = (&self.levels[level], &self.levels[level + 1]);
        Ok(self.form.transfer(x, from, to)?.into())
    }

    fn repair(&mut self, level: usize, x: &mut [f64]) -> Result<(), GeodesicError> {
        let objective = self.objective(level)?;
        self.form.repair(&self.levels[level], &objective, x);
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
        let Level { grid, steps, .. } = self.levels[level];
        self.reports.push(LevelReport {
            nodes: grid.nodes_per_axis().to_vec(),
            steps,
            form: self.params.form,
            mismatch_weight: self
                .params_on(&self.levels[level])
                .resolved_mismatch_weight(),
            targets: false,
            info: info.clone(),
            energy: F::energy(&objective).clone(),
        });
        Ok(())
    }
}

/// An observer of one of several sequences, which is told the numbers of their levels among all.
pub(crate) struct Numbered<'a> {
    /// Levels of earlier sequences.
    pub first: usize,
    /// All levels, where they are known; those of the earlier sequences and of this one otherwise.
    pub n_levels: Option<usize>,
    pub observer: &'a mut dyn Observer,
}

impl Observer for Numbered<'_> {
    fn level(&mut self, level: usize, n_levels: usize, dim: usize) {
        let all = self.n_levels.unwrap_or(self.first + n_levels);
        self.observer.level(self.first + level, all, dim);
    }

    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        self.observer.iteration(iteration)
    }

    fn resume(&mut self) -> Option<Memory<'static>> {
        self.observer.resume()
    }

    fn memory(&mut self, memory: &Memory<'_>) {
        self.observer.memory(memory);
    }

    fn remembers(&mut self, ended: bool) -> bool {
        self.observer.remembers(ended)
    }

    fn between(&mut self) -> Control {
        self.observer.between()
    }
}
