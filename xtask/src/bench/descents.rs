//! The gradient descent of the notes in a process of its own, to the energies of the default
//! solver.

use fe_grid::ScalarField;
use serde::{Deserialize, Serialize};
use shape_average::AverageParams;

use super::averages::CurvePoint;
use super::clock::{peak_mebibytes, process_seconds};
use super::measure::use_threads;
use super::shapes::Source;
use crate::descent::{LevelDescent, MULTIPLES};
use crate::outcome::Outcome;

/// A gradient descent to be run on one thread.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DescentJob {
    /// The shapes.
    pub source: Source,
    /// Parameters.
    pub params: AverageParams,
    /// For every level, coarsest first: the energy to be reached, and the number of evaluations of
    /// the other solver.
    pub levels: Vec<(f64, usize)>,
}

/// Cost of a descent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DescentReport {
    /// Processor seconds of the whole process.
    pub cpu: f64,
    /// Peak memory, in MiB.
    pub peak_mebibytes: f64,
    /// Levels, coarsest first.
    pub levels: Vec<DescentLevel>,
    /// Energies over time.
    pub curve: Vec<CurvePoint>,
}

/// Measurements of a level.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DescentLevel {
    /// Evaluations of one shape's energy.
    pub evaluations: usize,
    /// Whether the energy was reached.
    pub reached: bool,
    /// Excess over that energy after each of [`MULTIPLES`] times the evaluations of the other
    /// solver, relative to the decrease from the undeformed shapes.
    pub above: [f64; MULTIPLES.len()],
}

impl DescentJob {
    /// Runs the descent in this process.
    pub fn run(&self) -> Outcome<DescentReport> {
        use_threads(1)?;
        match self.source.dimension()? {
            2 => self.descend(&self.source.distances::<2>()?),
            _ => self.descend(&self.source.distances::<3>()?),
        }
    }

    fn descend<const D: usize>(&self, shapes: &[ScalarField<f64, D>]) -> Outcome<DescentReport> {
        let mut descent = LevelDescent::new(shapes, &self.params);
        let mut curve = Vec::new();
        let mut levels = Vec::new();
        for (level, &(target, unit)) in self.levels.iter().enumerate() {
            let mut note = |_, energy| {
                curve.push(CurvePoint {
                    cpu: process_seconds(),
                    level,
                    energy,
                });
            };
            let found = descent.descend(level, target, unit, &mut note)?;
            let drop = found.undeformed - target;
            let above =
                |energy: Option<f64>| ((energy.unwrap_or(found.energy) - target) / drop).max(0.0);
            levels.push(DescentLevel {
                evaluations: found.evaluations,
                reached: found.reached,
                above: found.passed.map(above),
            });
        }
        Ok(DescentReport {
            cpu: process_seconds(),
            peak_mebibytes: peak_mebibytes(),
            levels,
            curve,
        })
    }
}
