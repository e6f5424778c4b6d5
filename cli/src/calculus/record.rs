//! What `result.json` tells of equations and of the shapes that they lead to.

use ::geodesic::calculus::{SolveReport, SolveStatus};
use serde::Serialize;

use crate::report::{CANCELLED, CertificateRecord};

/// Everything in `result.json` of `shapespace extend`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ExtensionRecord {
    pub version: &'static str,
    pub status: &'static str,
    pub dimension: usize,
    /// Nodes along each axis of the arrays, `x` first.
    pub nodes: Vec<usize>,
    /// The directory that was continued.
    pub geodesic: String,
    /// Steps of the geodesic: the shapes up to this are its own.
    pub given_steps: usize,
    /// Steps beyond it that were asked for.
    pub steps: usize,
    /// Those that were found.
    pub steps_found: usize,
    /// A step was found where the correction left was this share of it.
    pub tolerance: f64,
    /// Start shapes on whose domains they were found.
    pub start_shapes: usize,
    /// `W_k` of all steps, the geodesic's first.
    pub step_energies: Vec<f64>,
    /// `sum sqrt W_k` of all steps.
    pub length: f64,
    /// Areas or volumes of all shapes.
    pub volumes: Vec<f64>,
    pub certificate: CertificateRecord,
    pub equations: Vec<EquationRecord>,
    pub seconds: f64,
}

/// Everything in `result.json` of `shapespace transport`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct TransportRecord {
    pub version: &'static str,
    pub status: &'static str,
    pub dimension: usize,
    /// Nodes along each axis of the arrays, `x` first.
    pub nodes: Vec<usize>,
    /// The directory along whose path the variation was carried.
    pub geodesic: String,
    /// Its steps, a rung each.
    pub given_steps: usize,
    pub variation: String,
    /// Steps from the first shape to the variation, and from the last to its counterpart.
    pub steps: usize,
    pub steps_found: usize,
    pub tolerance: f64,
    /// Overlap of the variation with what its logarithm makes of the first shape.
    pub dice_variation: f64,
    /// Length of the geodesic from the first shape to the variation.
    pub length_variation: f64,
    /// Length of the path from the last shape to the counterpart.
    pub length: f64,
    /// `W_k` of its steps.
    pub step_energies: Vec<f64>,
    /// Areas or volumes: first shape, variation, last shape, counterpart.
    pub volumes: [f64; 4],
    pub certificate: CertificateRecord,
    /// Of the rungs, then of the path to the counterpart.
    pub equations: Vec<EquationRecord>,
    pub seconds: f64,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct EquationRecord {
    status: &'static str,
    iterations: usize,
    evaluations: usize,
    /// Left of the correction, as a share of the step; where the state was folded at once there is
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    correction: Option<f64>,
    accepted: bool,
}

impl EquationRecord {
    /// The record of an equation.
    pub fn new(report: &SolveReport) -> Self {
        Self {
            status: name(report.status),
            iterations: report.iterations,
            evaluations: report.evaluations,
            correction: report.correction.is_finite().then_some(report.correction),
            accepted: report.accepted,
        }
    }
}

/// The name of a status.
pub(super) fn name(status: SolveStatus) -> &'static str {
    match status {
        SolveStatus::Converged => "converged",
        SolveStatus::MaxIterations => "max_iterations",
        SolveStatus::Stalled => "stalled",
        SolveStatus::Cancelled => CANCELLED,
        _ => "other",
    }
}
