//! The contents of `result.json`. What does not exist is left out; there are no nulls.

use fe_grid::minimise::Status;
use levelset::{Hausdorff, LevelsetError, Moments};
use serde::Serialize;
use shape_average::{AverageResult, Energy, LevelReport, MemoryEstimate};

use super::place::AlignmentRecord;
use super::shapes::Input;
use super::{Outcome, Parameters};
use crate::input::fit::FrameTransform;

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
    pub seconds: f64,
    /// Of these, the minimisation.
    pub solver_seconds: f64,
    /// Bytes by purpose, as they were estimated before.
    pub memory_estimate: MemoryEstimate,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_memory_bytes: Option<u64>,
}

/// One input, where it lies, and how large it is.
#[derive(Clone, Debug, Serialize)]
pub(super) struct InputRecord<const D: usize> {
    pub path: String,
    /// Samples along each axis, `x` first.
    size: Vec<usize>,
    frame: FrameTransform<D>,
    /// Sample indices to world coordinates, where the file states them.
    #[serde(skip_serializing_if = "Option::is_none")]
    affine: Option<[[f64; 4]; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    alignment: Option<AlignmentRecord>,
    #[serde(flatten)]
    object: SizeRecord,
}

/// Area in 2D, volume in 3D.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct SizeRecord {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_input_units: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume_input_units: Option<f64>,
}

/// The terms of the functional; all but the total are without weights.
#[derive(Clone, Debug, Serialize)]
pub(super) struct EnergyRecord {
    pub total: f64,
    pub elastic: Vec<f64>,
    pub mismatch: Vec<f64>,
    pub length: f64,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct CertificateRecord {
    /// Whether all deformations are proven to be injective on every cell.
    pub certified: bool,
    /// A lower bound of their determinants.
    pub min_det: f64,
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

/// Where the coordinates of `average.stl` are at home.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct SurfaceRecord {
    /// `world` (the affine map of that input), `input` (sample times spacing) or `unit_box`.
    pub coordinates: &'static str,
    /// Position of the input whose coordinates these are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of_input: Option<usize>,
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
            status: overall(result),
            dimension: D,
            nodes: result.average.grid().nodes_per_axis().to_vec(),
            input: inputs.iter().map(InputRecord::new).collect(),
            parameters: outcome.parameters.clone(),
            energy: EnergyRecord::new(&result.energy),
            iterations: levels.iter().map(|level| level.iterations).sum(),
            evaluations: levels.iter().map(|l| l.evaluations.energies()).sum(),
            shape_evaluations: result.shape_evaluations(),
            levels: levels.iter().map(LevelRecord::new).collect(),
            certificate: CertificateRecord {
                certified: result.certificate.certified,
                min_det: result.certificate.min_det,
            },
            dice: result.dice.clone(),
            mean_dice: result.mean_dice(),
            hausdorff: distances(result, |_| 1.0),
            hausdorff_input_units: distances(result, |i| inputs[i].frame.scale()),
            average: volume.map_or_else(
                |_| SizeRecord::default(),
                |moments| SizeRecord::new::<D>(moments.volume, common_scale(inputs)),
            ),
            surface,
            seconds: outcome.start.elapsed().as_secs_f64(),
            solver_seconds: result.seconds,
            memory_estimate: outcome.memory,
            peak_memory_bytes: peak_memory(),
        }
    }

    /// Whether the user stopped the minimisation.
    pub fn cancelled(&self) -> bool {
        self.status == name(Status::Cancelled)
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

/// The scale of all frames, where they have one. Scales that are one up to rounding are one.
pub(super) fn common_scale<const D: usize>(inputs: &[Input<D>]) -> Option<f64> {
    let first = inputs.first()?.frame.scale();
    let same = |input: &Input<D>| (input.frame.scale() / first - 1.0).abs() < 1e-12;
    inputs.iter().all(same).then_some(first)
}

impl<const D: usize> InputRecord<D> {
    fn new(input: &Input<D>) -> Self {
        Self {
            path: input.path.display().to_string(),
            size: input.size.to_vec(),
            frame: input.frame,
            affine: input.affine,
            alignment: input.alignment.map(|alignment| alignment.record()),
            object: SizeRecord::new::<D>(input.volume, Some(input.frame.scale())),
        }
    }
}

impl SizeRecord {
    fn new<const D: usize>(volume: f64, scale: Option<f64>) -> Self {
        let physical = scale.map(|scale| volume / scale.powi(D as i32));
        if D == 2 {
            Self {
                area: Some(volume),
                area_input_units: physical,
                ..Self::default()
            }
        } else {
            Self {
                volume: Some(volume),
                volume_input_units: physical,
                ..Self::default()
            }
        }
    }
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
            certificate: CertificateRecord {
                certified: level.certificate.certified,
                min_det: level.certificate.min_det,
            },
            seconds: level.seconds,
        }
    }
}

fn overall<const D: usize>(result: &AverageResult<D>) -> &'static str {
    let last = result.levels.last().map(|level| level.status);
    if last == Some(Status::Cancelled) {
        return name(Status::Cancelled);
    }
    if result.status.converged() {
        return "converged";
    }
    name(result.status)
}

fn name(status: Status) -> &'static str {
    match status {
        Status::GradientTolerance => "gradient_tolerance",
        Status::EnergyTolerance => "energy_tolerance",
        Status::MaxIterations => "max_iterations",
        Status::LineSearchFailed => "line_search_failed",
        Status::IndefiniteMetric => "indefinite_metric",
        Status::Cancelled => "cancelled",
        Status::InadmissibleStart => "inadmissible_start",
        _ => "other",
    }
}

/// The most memory this process has had, where the system tells (Linux).
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024 * kib)
}
