//! The contents of `result.json` of a metric.

use std::time::Instant;

use serde::Serialize;

use super::{MetricConfig, Outcome};
use crate::doubts::named;
use crate::report::{self, CONVERGED, unless_cancelled};
use crate::shapes::{Input, common_scale, records_of};
use crate::summary::Summary;

/// The picture of the flow.
pub(super) const PICTURE: &str = "metric.png";

/// Everything in `result.json`.
pub(super) type Record<const D: usize> = report::Record<MetricConfig, Found, D>;

/// The result.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Found {
    /// The squared length of the variation, `G`.
    metric: f64,
    /// Its length, `sqrt G`.
    speed: f64,
    /// `G` of the same motion in the length units of the inputs, in which volumes differ.
    #[serde(skip_serializing_if = "Option::is_none")]
    metric_input_units: Option<f64>,
    /// The shares of change of volume and of shear in `G`; missing for a rigid motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    volume_share: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shear_share: Option<f64>,
    /// The variation.
    variation: VariationRecord,
    /// `(int (v . n - v_n)^2)^(1/2)` relative to that of `v_n`.
    boundary_residual: f64,
    /// The energy of the void relative to `G`; it is no part of it.
    void_share: f64,
    discretisation: Discretisation,
    /// Updates of the multipliers, and iterations of conjugate gradients.
    rounds: usize,
    iterations: usize,
}

/// The variation.
#[derive(Clone, Debug, Serialize)]
struct VariationRecord {
    /// `towards`, `dilation`, `mode` or `translation`.
    kind: &'static str,
    /// Its root mean square over the boundary.
    root_mean_square: f64,
    /// Length or area of the boundary.
    boundary: f64,
}

/// The error by the grid, and by the samples of a mask.
#[derive(Clone, Debug, Serialize)]
struct Discretisation {
    /// `G` on the grid of twice the spacing.
    #[serde(skip_serializing_if = "Option::is_none")]
    metric_half_grid: Option<f64>,
    /// The extrapolation of order two to spacing zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    metric_extrapolated: Option<f64>,
    /// Their estimate of the error of `G` by the grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<f64>,
    /// The estimated error of `G` by the samples; masks of two values only.
    #[serde(skip_serializing_if = "Option::is_none")]
    sampling_error: Option<f64>,
}

/// The record of a result. The time is measured up to this call.
pub(super) fn record<const D: usize>(outcome: &Outcome<D>, start: Instant) -> Record<D> {
    let Outcome { inputs, found, .. } = outcome;
    let (flow, config) = (&found.flow, &outcome.config);
    let metric = flow.metric();
    // The volume of a unit cube of the inputs in the box.
    let unit = common_scale(inputs.iter().map(Input::scale)).map(|scale| scale.powi(D as i32));
    let share = |part: f64| Some(part / metric).filter(|_| flow.deforms());
    let body = Found {
        metric,
        speed: metric.max(0.0).sqrt(),
        metric_input_units: unit.map(|unit| metric / unit),
        volume_share: share(flow.volume_part()),
        shear_share: share(flow.shear_part()),
        variation: VariationRecord {
            kind: match config {
                MetricConfig {
                    variation: Some(_), ..
                } => "towards",
                MetricConfig { mode: Some(_), .. } => "mode",
                MetricConfig { dilation: true, .. } => "dilation",
                _ => "translation",
            },
            root_mean_square: flow.variation_norm / flow.boundary.sqrt(),
            boundary: flow.boundary,
        },
        boundary_residual: flow.residual,
        void_share: flow.void_share,
        discretisation: Discretisation {
            metric_half_grid: found.half_grid,
            metric_extrapolated: found.extrapolated(),
            error: found.error(),
            sampling_error: found.sampling_error,
        },
        rounds: flow.rounds,
        iterations: flow.iterations,
    };
    let ended = if flow.converged {
        CONVERGED
    } else {
        "max_iterations"
    };
    let status = unless_cancelled(outcome.interrupted, ended);
    let grid = outcome.distance.grid();
    let doubts = named(&outcome.doubts, inputs.iter().map(|input| &*input.name));
    Record::new(status, Some(grid), config, body, doubts, start).of(records_of(inputs))
}

/// The summary of a result.
pub(super) fn summary<const D: usize>(record: &Record<D>) -> Summary {
    let found = &record.body;
    let title = format!(
        "Metric of a variation on {} nodes: {}, {:.1} s",
        record.grid(),
        record.state(),
        record.seconds
    );
    let mut summary = Summary::new(record, PICTURE, title);
    let Discretisation {
        error,
        sampling_error,
        ..
    } = found.discretisation;
    let parts = [
        (error, "by the grid"),
        (sampling_error, "by the samples of the mask"),
    ];
    let parts = parts
        .into_iter()
        .filter_map(|(error, by)| Some(format!("{:.1e} {by}", error?)));
    let parts: Vec<String> = parts.collect();
    let error = match parts.as_slice() {
        [] => String::new(),
        parts => format!(" with an error of {}", parts.join(" and ")),
    };
    summary.line("metric", format!("{:.6e}{error}", found.metric));
    summary.line("speed", format!("{:.6e}, its root", found.speed));
    if let (Some(volume), Some(shear)) = (found.volume_share, found.shear_share) {
        let parts = [volume, shear].map(|share| 100.0 * share);
        summary.line(
            "parts",
            format!(
                "{:.1} % change of volume, {:.1} % shear",
                parts[0], parts[1]
            ),
        );
    }
    summary.line(
        "boundary",
        format!(
            "normal velocity off by {:.1e}, relative to the variation",
            found.boundary_residual
        ),
    );
    summary
}
