//! From coarse levels to fine.

use crate::buffer::Buffer;
use std::time::Instant;

use super::info::{Evaluations, Info, Status};
use super::objective::{Minimiser, Objective};
use super::observer::Observer;

/// A problem on several levels, coarsest first.
pub trait LevelProblem {
    /// What can go wrong.
    type Error;
    /// The objective of a level.
    type Objective: Objective<Error = Self::Error>;

    /// Number of levels.
    fn n_levels(&self) -> usize;

    /// Makes the objective of a level.
    ///
    /// # Errors
    /// Those of the problem.
    fn objective(&mut self, level: usize) -> Result<Self::Objective, Self::Error>;

    /// The state on the next finer level, from the state `x` on `level`.
    ///
    /// # Errors
    /// Those of the problem.
    fn prolong(&mut self, level: usize, x: &[f64]) -> Result<Buffer<f64>, Self::Error>;

    /// Makes a prolonged state admissible on its `level`.
    ///
    /// # Errors
    /// Those of the problem.
    fn repair(&mut self, level: usize, x: &mut [f64]) -> Result<(), Self::Error> {
        let _ = (level, x);
        Ok(())
    }

    /// A level is done: a chance to keep what its objective knows.
    ///
    /// # Errors
    /// Those of the problem.
    fn finish_level(
        &mut self,
        level: usize,
        objective: Self::Objective,
        x: &[f64],
        info: &Info,
    ) -> Result<(), Self::Error> {
        let _ = (level, objective, x, info);
        Ok(())
    }
}

/// Convergence history of a level.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelInfo {
    /// The level, counted from the coarsest.
    pub level: usize,
    /// Number of unknowns.
    pub dim: usize,
    /// The record of the minimisation.
    pub info: Info,
    /// Wall-clock time, with prolongation, repair and the making of the objective.
    pub seconds: f64,
}

/// The result of a multilevel minimisation.
#[derive(Clone, Debug, PartialEq)]
pub struct Multilevel {
    /// The state on the last level that was reached.
    pub x: Buffer<f64>,
    /// All levels that were reached: fewer than those of the problem if the observer cancelled or a
    /// level began with an inadmissible state; see the last status.
    pub levels: Vec<LevelInfo>,
}

impl Multilevel {
    /// The work done on all levels; an evaluation on a coarse level counts as much as another.
    pub fn evaluations(&self) -> Evaluations {
        let mut total = Evaluations::default();
        for level in &self.levels {
            total += level.info.evaluations;
        }
        total
    }

    /// How the last level ended, unless the problem has no levels.
    pub fn status(&self) -> Option<Status> {
        self.levels.last().map(|level| level.info.status)
    }
}

/// Minimises on every level, coarsest first, and carries the state up.
///
/// `minimiser` gives the method of each level; `x` is the state on the coarsest.
///
/// # Errors
/// Those of the problem and of its objectives.
pub fn minimise_levels<P, M>(
    problem: &mut P,
    mut minimiser: impl FnMut(usize) -> M,
    x: impl Into<Buffer<f64>>,
    observer: &mut dyn Observer,
) -> Result<Multilevel, P::Error>
where
    P: LevelProblem,
    M: Minimiser<P::Objective>,
{
    let mut x = x.into();
    let n_levels = problem.n_levels();
    let mut levels = Vec::with_capacity(n_levels);
    for level in 0..n_levels {
        let start = Instant::now();
        if level > 0 {
            x = problem.prolong(level - 1, &x)?;
        }
        problem.repair(level, &mut x)?;
        let mut objective = problem.objective(level)?;
        let dim = objective.dim();
        observer.level(level, n_levels, dim);
        let info = minimiser(level).minimise(&mut objective, &mut x, observer)?;
        problem.finish_level(level, objective, &x, &info)?;
        let status = info.status;
        levels.push(LevelInfo {
            level,
            dim,
            info,
            seconds: start.elapsed().as_secs_f64(),
        });
        if matches!(status, Status::Cancelled | Status::InadmissibleStart) {
            break;
        }
    }
    Ok(Multilevel { x, levels })
}
