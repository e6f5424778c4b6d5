//! The contents of `result.json` for equations and the resulting shapes.

use ::geodesic::calculus::SolveReport;
use fe_grid::Certificate;
use serde::Serialize;

use super::args::{ExtendConfig, TransportConfig};
use crate::report::Record;
use crate::shapes::BoundaryRecord;

/// The contents of `result.json` of `shapespace extend`.
pub(super) type ExtensionRecord<'a, const D: usize> = Record<ExtendConfig, Extended<'a>, D>;

/// The result of an extension.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Extended<'a> {
    /// Steps of the geodesic; the shapes up to this number are its own.
    pub given_steps: usize,
    /// Requested steps beyond its end.
    pub steps: usize,
    /// Computed steps beyond its end.
    pub steps_found: usize,
    /// Start shapes of the computed steps.
    pub start_shapes: usize,
    /// `W_k` of all steps, the geodesic's first.
    pub step_energies: Vec<f64>,
    /// `sum sqrt W_k` of all steps.
    pub length: f64,
    /// Areas or volumes of all shapes.
    pub volumes: Vec<f64>,
    pub certificate: Certificate,
    pub equations: &'a [SolveReport],
    /// The coordinates of the boundaries that are written: those of the geodesic.
    #[serde(flatten)]
    pub coordinates: BoundaryRecord,
}

/// The contents of `result.json` of `shapespace transport`.
pub(super) type TransportRecord<'a, const D: usize> = Record<TransportConfig, Transported<'a>, D>;

/// The result of a transport.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Transported<'a> {
    /// Steps of the geodesic, one rung each.
    pub given_steps: usize,
    /// Computed steps to the counterpart.
    pub steps_found: usize,
    /// Overlap of the variation with the first shape, deformed by the logarithm of the variation.
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
    /// For the rungs, then for the path to the counterpart.
    pub equations: &'a [SolveReport],
    /// As of an extension.
    #[serde(flatten)]
    pub coordinates: BoundaryRecord,
}
