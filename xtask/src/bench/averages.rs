//! One average in a process of its own: its time, work, memory and quality.

use std::path::PathBuf;

use fe_grid::minimise::{Control, Iteration, Observer};
use fe_grid::transfer::inject_into;
use fe_grid::{Field, ScalarField};
use levelset::{Moments, dice};
use serde::{Deserialize, Serialize};
use shape_average::{AverageParams, AverageResult, LevelShapes, average, average_on_levels};

use super::clock::{Stopwatch, peak_mebibytes, process_seconds};
use super::measure::use_threads;
use super::shapes::{Source, nodal};
use crate::outcome::Outcome;

/// An average to be computed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AverageJob {
    /// The shapes.
    pub source: Source,
    /// Parameters.
    pub params: AverageParams,
    /// Origin of phase fields and weights.
    pub fields: Fields,
    /// Number of threads.
    pub threads: usize,
}

/// Origin of the phase fields and of the elastic weights.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Fields {
    /// Those of the program.
    Own,
    /// The weights of the authors' code, `clamp(d / h + 3.5, 1e-3, 1)` with the signed distance
    /// `d`, on every level; and phase fields from files on the finest level, if there are any.
    Authors {
        /// Arrays of nodal values, one for each shape, or none.
        phase_fields: Vec<PathBuf>,
    },
}

/// Smallest weight in the authors' code.
pub const AUTHORS_VOID: f64 = 1e-3;

/// The energy at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Processor time since the process began.
    pub cpu: f64,
    /// The level, counted from the coarsest.
    pub level: usize,
    /// The objective.
    pub energy: f64,
}

/// Measurements of a level.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// Nodes along every axis.
    pub nodes: usize,
    /// Accepted steps.
    pub iterations: usize,
    /// Evaluations of one shape's energy.
    pub evaluations: usize,
    /// Energy at the end of the level.
    pub energy: f64,
    /// Status at the end.
    pub status: String,
}

/// Cost and result of an average.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AverageReport {
    /// Number of shapes.
    pub shapes: usize,
    /// Nodes of the grid.
    pub nodes: usize,
    /// Processor seconds of the whole process up to the result: shapes, distances, average.
    pub cpu: f64,
    /// Wall seconds of the same.
    pub wall: f64,
    /// Processor seconds of the average alone.
    pub average_cpu: f64,
    /// Wall seconds of the average alone.
    pub average_wall: f64,
    /// Peak memory, in MiB.
    pub peak_mebibytes: f64,
    /// Levels, coarsest first.
    pub levels: Vec<Level>,
    /// Energies over time.
    pub curve: Vec<CurvePoint>,
    /// The functional `J`.
    pub functional: f64,
    /// Sum of the elastic energies.
    pub elastic: f64,
    /// Sum of the mismatches.
    pub mismatch: f64,
    /// Interface length of the average.
    pub length: f64,
    /// Mean overlap of the images of the shapes with the average.
    pub mean_dice: f64,
    /// Mean overlap of two images of shapes.
    pub pair_dice: f64,
    /// Smallest overlap of two images of shapes.
    pub worst_pair_dice: f64,
    /// Smallest determinant.
    pub min_det: f64,
    /// Whether it is certified to be positive everywhere.
    pub certified: bool,
    /// Area or volume of the average over the mean of those of the shapes.
    pub volume_ratio: f64,
    /// Status of the solver.
    pub status: String,
}

impl AverageReport {
    /// Accepted steps on the finest level.
    pub fn finest_iterations(&self) -> usize {
        self.levels.last().map_or(0, |l| l.iterations)
    }

    /// Evaluations of one shape's energy on all levels.
    pub fn evaluations(&self) -> usize {
        self.levels.iter().map(|l| l.evaluations).sum()
    }

    /// Processor time of the process when the finest level first had an energy this low.
    pub fn cpu_at(&self, energy: f64) -> Option<f64> {
        let finest = self.levels.len().checked_sub(1)?;
        let mut points = self.curve.iter().filter(|p| p.level == finest);
        points.find(|p| p.energy <= energy).map(|p| p.cpu)
    }
}

impl AverageJob {
    /// Computes the average in this process.
    pub fn run(&self) -> Outcome<AverageReport> {
        let watch = Stopwatch::start();
        use_threads(self.threads)?;
        match self.source.dimension()? {
            2 => self.in_dimension::<2>(watch),
            _ => self.in_dimension::<3>(watch),
        }
    }

    fn in_dimension<const D: usize>(&self, watch: Stopwatch) -> Outcome<AverageReport> {
        let distances = self.source.distances::<D>()?;
        let mut recorder = Recorder::default();
        let alone = Stopwatch::start();
        let result = match &self.fields {
            Fields::Own => average(&distances, &self.params, &mut recorder)?,
            Fields::Authors { phase_fields } => {
                let levels = authors_levels(&distances, &self.params, phase_fields)?;
                average_on_levels(&distances, levels, &self.params, &mut recorder)?
            }
        };
        let (average_cpu, average_wall) = (alone.cpu(), alone.wall());
        let (cpu, wall) = (process_seconds(), watch.wall());
        let peak = peak_mebibytes();
        let (pair_dice, worst_pair_dice) = pairs(&result.pushed)?;
        Ok(AverageReport {
            shapes: distances.len(),
            nodes: distances[0].grid().n_nodes(),
            cpu,
            wall,
            average_cpu,
            average_wall,
            peak_mebibytes: peak,
            levels: levels(&result),
            curve: recorder.curve,
            functional: result.energy.total,
            elastic: result.energy.elastic.iter().sum(),
            mismatch: result.energy.mismatch.iter().sum(),
            length: result.energy.length,
            mean_dice: result.mean_dice(),
            pair_dice,
            worst_pair_dice,
            min_det: result.certificate.min_det,
            certified: result.certificate.certified,
            volume_ratio: volume_ratio(&distances, &result)?,
            status: format!("{:?}", result.status),
        })
    }
}

fn levels<const D: usize>(result: &AverageResult<D>) -> Vec<Level> {
    let level = |report: &shape_average::LevelReport| Level {
        nodes: report.nodes[0],
        iterations: report.iterations,
        evaluations: report.shape_evaluations,
        energy: report.energies.last().copied().unwrap_or(f64::NAN),
        status: format!("{:?}", report.status),
    };
    result.levels.iter().map(level).collect()
}

/// Records energies during the minimisation.
#[derive(Default)]
struct Recorder {
    level: usize,
    curve: Vec<CurvePoint>,
}

impl Observer for Recorder {
    fn level(&mut self, level: usize, _n_levels: usize, _dim: usize) {
        self.level = level;
    }

    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        self.curve.push(CurvePoint {
            cpu: process_seconds(),
            level: self.level,
            energy: iteration.energy,
        });
        Control::Continue
    }
}

/// The shapes on all levels as in the authors' code, coarsest first. Levels without phase fields of
/// that code have our exact profiles of the same width.
pub fn authors_levels<const D: usize>(
    distances: &[ScalarField<f64, D>],
    params: &AverageParams,
    phase_fields: &[PathBuf],
) -> Outcome<Vec<LevelShapes<D>>> {
    let grids = distances[0].grid().hierarchy(params.coarsest_nodes);
    let finest = grids.len() - 1;
    let mut levels = Vec::with_capacity(grids.len());
    let mut own = distances.to_vec();
    for (level, grid) in grids.iter().enumerate().rev() {
        if level < finest {
            own = own.iter().map(|d| injected(grid, d)).collect();
        }
        let mut shapes = LevelShapes::new(*grid, &own, params)?;
        if level == finest && !phase_fields.is_empty() {
            let given = phase_fields.iter().map(|file| nodal(file));
            shapes.phase_fields = given.collect::<Outcome<_>>()?;
        }
        let weight = |d: f64| indicator(d, grid.spacing(), params.void_stiffness);
        shapes.indicators = own
            .iter()
            .map(|d| {
                let values = d.as_slice().iter().map(|&d| weight(d)).collect();
                Ok(ScalarField::from_vec(*grid, values)?)
            })
            .collect::<Outcome<_>>()?;
        levels.push(shapes);
    }
    levels.reverse();
    Ok(levels)
}

fn injected<const D: usize>(
    grid: &fe_grid::Grid<D>,
    fine: &ScalarField<f64, D>,
) -> ScalarField<f64, D> {
    let mut coarse = Field::zeros(*grid);
    inject_into(grid, fine.as_slice(), coarse.as_mut_slice());
    coarse
}

/// The indicator `chi` for which `(1 - delta) chi + delta` is the authors' weight.
fn indicator(distance: f64, spacing: f64, void_stiffness: f64) -> f64 {
    let weight = (distance / spacing + 3.5).clamp(AUTHORS_VOID, 1.0);
    (weight - void_stiffness) / (1.0 - void_stiffness)
}

/// Mean and least overlap of all pairs.
fn pairs<const D: usize>(pushed: &[ScalarField<f64, D>]) -> Outcome<(f64, f64)> {
    let (mut sum, mut least, mut n) = (0.0, 1.0f64, 0.0);
    for (i, a) in pushed.iter().enumerate() {
        for b in &pushed[..i] {
            let overlap = dice(a, 0.0, b, 0.0)?;
            (sum, least, n) = (sum + overlap, least.min(overlap), n + 1.0);
        }
    }
    Ok(if n > 0.0 {
        (sum / n, least)
    } else {
        (1.0, 1.0)
    })
}

/// Volumes are those of ramps one spacing wide, as in the average's indicator.
fn volume_ratio<const D: usize>(
    distances: &[ScalarField<f64, D>],
    result: &AverageResult<D>,
) -> Outcome<f64> {
    let mut mean = 0.0;
    for d in distances {
        let h = d.grid().spacing();
        let ramp = |d: &f64| (0.5 + d / h).clamp(0.0, 1.0);
        let values = d.as_slice().iter().map(ramp).collect();
        mean += Moments::of_density(&ScalarField::from_vec(*d.grid(), values)?)?.volume;
    }
    let average = Moments::of_density(&result.average_indicator)?.volume;
    Ok(average * distances.len() as f64 / mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_of_the_authors_is_a_ramp_of_one_cell_outside_the_object() {
        let h = 0.25;
        let weight = |d: f64| {
            let chi = indicator(d, h, AUTHORS_VOID);
            (1.0 - AUTHORS_VOID) * chi + AUTHORS_VOID
        };
        for (distance, expected) in [(1.0, 1.0), (-2.5 * h, 1.0), (-3.0 * h, 0.5), (-9.0, 1e-3)] {
            // Two roundings.
            assert!((weight(distance) - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn a_report_knows_when_the_finest_level_was_low_enough() {
        let point = |cpu, level, energy| CurvePoint { cpu, level, energy };
        let level = |nodes| Level {
            nodes,
            iterations: 2,
            evaluations: 6,
            energy: 1.0,
            status: String::new(),
        };
        let report = AverageReport {
            shapes: 2,
            nodes: 289,
            cpu: 9.0,
            wall: 9.0,
            average_cpu: 8.0,
            average_wall: 8.0,
            peak_mebibytes: 1.0,
            levels: vec![level(9), level(17)],
            curve: vec![
                point(1.0, 0, 0.1),
                point(2.0, 1, 3.0),
                point(3.0, 1, 2.0),
                point(4.0, 1, 1.0),
            ],
            functional: 1.0,
            elastic: 0.0,
            mismatch: 0.0,
            length: 0.0,
            mean_dice: 1.0,
            pair_dice: 1.0,
            worst_pair_dice: 1.0,
            min_det: 1.0,
            certified: true,
            volume_ratio: 1.0,
            status: String::new(),
        };
        assert_eq!(report.cpu_at(2.5), Some(3.0));
        assert_eq!(report.cpu_at(0.5), None);
        assert_eq!((report.evaluations(), report.finest_iterations()), (12, 2));
    }

    #[test]
    fn the_authors_levels_hold_the_phase_fields_that_are_given() {
        let distances = Source::Blobs {
            dimension: 2,
            nodes: 17,
            count: 2,
        }
        .distances::<2>()
        .unwrap();
        let params = AverageParams {
            void_stiffness: AUTHORS_VOID,
            ..AverageParams::default()
        };
        let levels = authors_levels(&distances, &params, &[]).unwrap();
        let nodes: Vec<usize> = levels.iter().map(|l| l.grid().n_nodes()).collect();
        assert_eq!(nodes, [81, 289]);
        let own = LevelShapes::new(*distances[0].grid(), &distances, &params).unwrap();
        assert_eq!(levels[1].phase_fields, own.phase_fields);
        assert_ne!(levels[1].indicators, own.indicators);
    }
}
