//! The contents of `result.json`. What does not exist is left out; there are no nulls.

use ::geodesic::LevelReport;
use levelset::Contour;
use serde::Serialize;

use super::path::Path;
use super::{Outcome, Parameters};
use crate::report::{CANCELLED, CertificateRecord, name, overall, peak_memory};
use crate::shapes::{InputRecord, SurfaceRecord, common_scale};

/// Everything in `result.json`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ResultRecord<const D: usize> {
    pub version: &'static str,
    pub status: &'static str,
    pub dimension: usize,
    /// Nodes along each axis of the arrays, `x` first.
    pub nodes: Vec<usize>,
    /// Start and end.
    pub input: Vec<InputRecord<D>>,
    pub parameters: Parameters,
    /// `sum sqrt W_k`.
    pub length: f64,
    /// The same in the length units of the inputs: a length grows as the square root of a volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_input_units: Option<f64>,
    /// `K sum W_k`, at least the square of the length.
    pub dissipation: f64,
    /// The steps `W_k`.
    pub step_energies: Vec<f64>,
    /// Unweighted: of the last shape with the end shape, or of every shape with the next.
    pub matches: Vec<f64>,
    /// What was minimised.
    pub total: f64,
    /// Overlap of the end shape with what the deformations make of the start shape.
    pub dice_end: f64,
    /// Mean distance of their boundaries, in spacings of the grid.
    pub gap_end: f64,
    /// The same for every component, where there are several: all labels, then the level sets that
    /// tell them apart.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dice_components: Vec<f64>,
    /// Whether that overlap says that the end shape is reached.
    pub end_reached: bool,
    /// Overlap of the start shape with the end shape pulled back through all steps.
    pub dice_pulled: f64,
    pub certificate: CertificateRecord,
    /// Areas or volumes of the shapes `0, ..., K`.
    pub volumes: Vec<f64>,
    /// Lengths or areas of their boundaries.
    pub boundaries: Vec<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volumes_input_units: Option<Vec<f64>>,
    pub levels: Vec<LevelRecord>,
    /// Accepted steps on all levels.
    pub iterations: usize,
    /// Evaluations of the functional on all levels, with or without gradient.
    pub evaluations: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceRecord>,
    pub seconds: f64,
    /// Of these, the minimisation with its first path.
    pub solver_seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_memory_bytes: Option<u64>,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct LevelRecord {
    nodes: Vec<usize>,
    steps: usize,
    status: &'static str,
    iterations: usize,
    evaluations: usize,
    /// What was minimised, at the end.
    energy: f64,
    step_energies: Vec<f64>,
    matches: Vec<f64>,
}

impl<const D: usize> ResultRecord<D> {
    /// The record of an outcome. The time is that until now.
    pub fn new(outcome: &Outcome<D>, path: &Path<D>, surface: Option<SurfaceRecord>) -> Self {
        let (inputs, result) = (&outcome.inputs, &outcome.result);
        let scale = common_scale(inputs);
        let unit = |scale: f64| scale.powi(D as i32);
        let levels = &result.levels;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            status: overall(result.status, levels.last().map(|level| level.info.status)),
            dimension: D,
            nodes: result.level_sets[0].grid().nodes_per_axis().to_vec(),
            input: inputs.iter().map(InputRecord::new).collect(),
            parameters: outcome.parameters.clone(),
            length: result.length(),
            length_input_units: scale.map(|scale| result.length() / unit(scale).sqrt()),
            dissipation: result.dissipation(),
            step_energies: result.step_energies.clone(),
            matches: result.matches.clone(),
            total: result.total,
            dice_end: result.dice_end,
            gap_end: result.gap_end,
            dice_components: if result.components.is_empty() {
                Vec::new()
            } else {
                result.dice_components.clone()
            },
            end_reached: result.end_reached(),
            dice_pulled: result.dice_pulled,
            certificate: CertificateRecord::new(&result.certificate),
            volumes: path.sizes.clone(),
            boundaries: path.contours.iter().map(Contour::perimeter).collect(),
            volumes_input_units: scale
                .map(|scale| path.sizes.iter().map(|v| v / unit(scale)).collect()),
            iterations: levels.iter().map(|level| level.info.iterations).sum(),
            evaluations: levels.iter().map(|l| l.info.evaluations.energies()).sum(),
            levels: levels.iter().map(LevelRecord::new).collect(),
            surface,
            seconds: outcome.start.elapsed().as_secs_f64(),
            solver_seconds: outcome.solver_seconds,
            peak_memory_bytes: peak_memory(),
        }
    }

    /// Whether the user stopped the minimisation.
    pub fn cancelled(&self) -> bool {
        self.status == CANCELLED
    }
}

impl LevelRecord {
    fn new(level: &LevelReport) -> Self {
        Self {
            nodes: level.nodes.clone(),
            steps: level.steps,
            status: name(level.info.status),
            iterations: level.info.iterations,
            evaluations: level.info.evaluations.energies(),
            energy: level.total,
            step_energies: level.step_energies.clone(),
            matches: level.matches.clone(),
        }
    }
}
