//! The contents of `result.json`. What does not exist is left out; there are no nulls.

use levelset::{Hausdorff, LevelsetError, Moments};
use serde::Serialize;
use shape_average::{AverageResult, Energy, LevelReport, MemoryEstimate};

use super::{Outcome, Parameters};
use crate::report::{CANCELLED, CertificateRecord, name, overall, peak_memory};
use crate::shapes::{InputRecord, SizeRecord, SurfaceRecord, common_scale};

/// Everything in `result.json`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ResultRecord<const D: usize> {
    pub version: &'static str,
    pub status: &'static str,
    pub dimension: usize,
    /// Nodes along each axis of the arrays, `x` first.
    pub nodes: Vec<usize>,
    pub input: Vec<InputRecord<D>>,
    pub parameters: Parameters,
    pub energy: EnergyRecord,
    pub levels: Vec<LevelRecord>,
    /// Accepted steps on all levels.
    pub iterations: usize,
    /// Evaluations of the functional on all levels, with or without gradient.
    pub evaluations: usize,
    /// Evaluations of one shape's part of the functional on all levels.
    pub shape_evaluations: usize,
    pub certificate: CertificateRecord,
    pub dice: Vec<f64>,
    pub mean_dice: f64,
    /// In lengths of the unit box.
    pub hausdorff: Vec<DistanceRecord>,
    /// In the length units of each input.
    pub hausdorff_input_units: Vec<DistanceRecord>,
    pub average: SizeRecord,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceRecord>,
    /// Of a median: the sum of roots before the first and after every round.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rounds: Vec<f64>,
    pub seconds: f64,
    /// Of these, the minimisation.
    pub solver_seconds: f64,
    /// Bytes by purpose, as they were estimated before.
    pub memory_estimate: MemoryEstimate,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_memory_bytes: Option<u64>,
}

/// The terms of the functional; all but the total are without weights.
#[derive(Clone, Debug, Serialize)]
pub(super) struct EnergyRecord {
    pub total: f64,
    pub elastic: Vec<f64>,
    pub mismatch: Vec<f64>,
    pub length: f64,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct LevelRecord {
    nodes: Vec<usize>,
    interface_width: f64,
    status: &'static str,
    iterations: usize,
    evaluations: usize,
    work: WorkRecord,
    energy: EnergyRecord,
    certificate: CertificateRecord,
    seconds: f64,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct WorkRecord {
    values: usize,
    gradients: usize,
    shape_evaluations: usize,
    metric_builds: usize,
    metric_applications: usize,
    average_iterations: usize,
}

/// Distances of two boundaries; empty where one of them does not exist.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct DistanceRecord {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub maximum: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub percentile_95: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean: Option<f64>,
}

impl<const D: usize> ResultRecord<D> {
    /// The record of an outcome whose average has this area or volume. The time is that until
    /// now.
    pub fn new(
        outcome: &Outcome<D>,
        volume: Result<Moments<D>, LevelsetError>,
        surface: Option<SurfaceRecord>,
    ) -> Self {
        let (inputs, result) = (&outcome.inputs, &outcome.result);
        let levels = &result.levels;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            status: overall(result.status, levels.last().map(|level| level.status)),
            dimension: D,
            nodes: result.average.grid().nodes_per_axis().to_vec(),
            input: inputs.iter().map(InputRecord::new).collect(),
            parameters: outcome.parameters.clone(),
            energy: EnergyRecord::new(&result.energy),
            iterations: levels.iter().map(|level| level.iterations).sum(),
            evaluations: levels.iter().map(|l| l.evaluations.energies()).sum(),
            shape_evaluations: result.shape_evaluations(),
            levels: levels.iter().map(LevelRecord::new).collect(),
            certificate: CertificateRecord::new(&result.certificate),
            dice: result.dice.clone(),
            mean_dice: result.mean_dice(),
            hausdorff: distances(result, |_| 1.0),
            hausdorff_input_units: distances(result, |i| inputs[i].frame.scale()),
            average: volume.map_or_else(
                |_| SizeRecord::default(),
                |moments| SizeRecord::new::<D>(moments.volume, common_scale(inputs)),
            ),
            surface,
            rounds: result.rounds.clone(),
            seconds: outcome.start.elapsed().as_secs_f64(),
            solver_seconds: result.seconds,
            memory_estimate: outcome.memory,
            peak_memory_bytes: peak_memory(),
        }
    }

    /// Whether the user stopped the minimisation.
    pub fn cancelled(&self) -> bool {
        self.status == CANCELLED
    }
}

fn distances<const D: usize>(
    result: &AverageResult<D>,
    scale: impl Fn(usize) -> f64,
) -> Vec<DistanceRecord> {
    let of = |distance: Hausdorff, scale: f64| DistanceRecord {
        maximum: Some(distance.maximum / scale),
        percentile_95: Some(distance.percentile_95 / scale),
        mean: Some(distance.mean / scale),
    };
    let found = result.hausdorff.iter().enumerate();
    found
        .map(|(i, distance)| distance.map_or_else(DistanceRecord::default, |d| of(d, scale(i))))
        .collect()
}

impl EnergyRecord {
    fn new(energy: &Energy) -> Self {
        Self {
            total: energy.total,
            elastic: energy.elastic.clone(),
            mismatch: energy.mismatch.clone(),
            length: energy.length,
        }
    }
}

impl LevelRecord {
    fn new(level: &LevelReport) -> Self {
        Self {
            nodes: level.nodes.clone(),
            interface_width: level.interface_width,
            status: name(level.status),
            iterations: level.iterations,
            evaluations: level.evaluations.energies(),
            work: WorkRecord {
                values: level.evaluations.values,
                gradients: level.evaluations.gradients,
                shape_evaluations: level.shape_evaluations,
                metric_builds: level.evaluations.metric_builds,
                metric_applications: level.evaluations.metric_applications,
                average_iterations: level.average_iterations,
            },
            energy: EnergyRecord::new(&level.energy),
            certificate: CertificateRecord::new(&level.certificate),
            seconds: level.seconds,
        }
    }
}
