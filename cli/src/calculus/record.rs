//! What `result.json` tells of equations and of the shapes that they lead to.

use ::geodesic::calculus::SolveReport;
use fe_grid::Certificate;
use serde::Serialize;

use super::args::{ExtendConfig, TransportConfig};
use crate::report::Record;

/// Everything in `result.json` of `shapespace extend`.
pub(super) type ExtensionRecord<'a, const D: usize> = Record<ExtendConfig, Extended<'a>, D>;

/// What an extension has found.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Extended<'a> {
    /// Steps of the geodesic: the shapes up to this are its own.
    pub given_steps: usize,
    /// Steps beyond it that were asked for.
    pub steps: usize,
    /// Those that were found.
    pub steps_found: usize,
    /// Start shapes on whose domains they were found.
    pub start_shapes: usize,
    /// `W_k` of all steps, the geodesic's first.
    pub step_energies: Vec<f64>,
    /// `sum sqrt W_k` of all steps.
    pub length: f64,
    /// Areas or volumes of all shapes.
    pub volumes: Vec<f64>,
    pub certificate: Certificate,
    pub equations: &'a [SolveReport],
}

/// Everything in `result.json` of `shapespace transport`.
pub(super) type TransportRecord<'a, const D: usize> = Record<TransportConfig, Transported<'a>, D>;

/// What a transport has found.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Transported<'a> {
    /// Steps of the geodesic, a rung each.
    pub given_steps: usize,
    /// Steps to the counterpart that were found.
    pub steps_found: usize,
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
    pub certificate: Certificate,
    /// Of the rungs, then of the path to the counterpart.
    pub equations: &'a [SolveReport],
}
