//! One geodesic in a process of its own: its time, energy and quality.

use fe_grid::minimise::{Control, Iteration, Observer};
use geodesic::{GeodesicParams, geodesic};
use serde::{Deserialize, Serialize};

use super::averages::CurvePoint;
use super::clock::{peak_mebibytes, process_seconds};
use super::measure::use_threads;
use super::shapes::Source;
use crate::outcome::Outcome;

/// A geodesic to be computed between the two shapes of a source.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PathJob {
    /// The shapes.
    pub source: Source,
    /// Parameters.
    pub params: GeodesicParams,
    /// Number of threads.
    pub threads: usize,
}

/// Cost and result of a geodesic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathReport {
    /// Processor seconds of the whole process up to the result.
    pub cpu: f64,
    /// Peak memory, in MiB.
    pub peak_mebibytes: f64,
    /// Energies over time, with the levels as reported by the solver.
    pub curve: Vec<CurvePoint>,
    /// Objective at the end.
    pub total: f64,
    /// `sum W_k`.
    pub elastic: f64,
    /// Sum of the unweighted mismatches.
    pub mismatch: f64,
    /// Boundary area of the end shape, which no path can change; level sets only.
    pub end_area: Option<f64>,
    /// `sum sqrt W_k`.
    pub length: f64,
    /// Overlaps of the deformed start shape with the end shape, and of the pulled-back end shape
    /// with the start shape.
    pub dice: (f64, f64),
    /// Smallest determinant.
    pub min_det: f64,
    /// Whether it is certified to be positive inside the objects.
    pub certified: bool,
    /// Status of the solver.
    pub status: String,
}

impl PathReport {
    /// Processor time of the process when the last level first had an energy this low.
    pub fn cpu_at(&self, energy: f64) -> Option<f64> {
        let last = self.curve.last()?.level;
        let mut points = self.curve.iter().filter(|p| p.level == last);
        points.find(|p| p.energy <= energy).map(|p| p.cpu)
    }
}

impl PathJob {
    /// Computes the path in this process.
    pub fn run(&self) -> Outcome<PathReport> {
        use_threads(self.threads)?;
        match self.source.dimension()? {
            2 => self.in_dimension::<2>(),
            _ => self.in_dimension::<3>(),
        }
    }

    fn in_dimension<const D: usize>(&self) -> Outcome<PathReport> {
        let distances = self.source.distances::<D>()?;
        let [start, end] = distances.as_slice() else {
            return Err("a path is between two shapes".into());
        };
        let mut recorder = Recorder::default();
        let path = geodesic(start, end, &self.params, &mut recorder)?;
        Ok(PathReport {
            cpu: process_seconds(),
            peak_mebibytes: peak_mebibytes(),
            curve: recorder.curve,
            total: path.energy.total,
            elastic: path.energy.step_energies.iter().sum(),
            mismatch: path.energy.mismatches.iter().sum(),
            end_area: path
                .levels
                .last()
                .and_then(|l| l.energy.areas.last().copied()),
            length: path.length(),
            dice: (path.dice_end, path.dice_pulled),
            min_det: path.certificate.min_det,
            certified: path.certificate.certified,
            status: format!("{:?}", path.status),
        })
    }
}

/// Records energies during the minimisation. A minimisation on another grid or with
/// another number of steps counts as a level.
#[derive(Default)]
struct Recorder {
    level: usize,
    curve: Vec<CurvePoint>,
}

impl Observer for Recorder {
    fn level(&mut self, _level: usize, _n_levels: usize, _dim: usize) {
        self.level += 1;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_between_two_blobs_is_reported() {
        let source = Source::Blobs {
            dimension: 2,
            nodes: 33,
            count: 2,
        };
        let params = GeodesicParams {
            steps: 2,
            ..GeodesicParams::default()
        };
        let job = PathJob {
            source,
            params,
            threads: 1,
        };
        let report = job.in_dimension::<2>().unwrap();
        assert!(report.certified && report.length > 0.0);
        assert!(report.length.powi(2) <= 2.0 * report.elastic * (1.0 + 1e-12));
        // The last energy of the last level is the total, so that it is reached at that time.
        let last = report.curve.last().unwrap();
        assert_eq!(report.cpu_at(last.energy), Some(last.cpu));
        assert_eq!(report.cpu_at(0.0), None);
    }
}
