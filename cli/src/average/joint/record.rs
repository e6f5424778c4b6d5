//! The contents of `result.json`, and the summary. Missing values are left out.

use std::time::Instant;

use phasefield::segmentation::Weights;
use serde::Serialize;
use shape_average::joint::{JointEnergy, JointResult, spread};

use super::{AverageConfig, Outcome};
use crate::doubts::named;
use crate::report::{self, overall};
use crate::summary::Summary;

/// Everything in `result.json`.
pub(super) type Record<'a, const D: usize> = report::Record<AverageConfig, Found<'a, D>, D>;

/// The result.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Found<'a, const D: usize> {
    #[serde(flatten)]
    result: &'a JointResult<D>,
    /// The terms of the energy: those of the shapes without weights, those of the images with theirs.
    energy: JointEnergy,
    /// The weights of the terms of every image.
    weights: Weights,
    /// Standard deviation of the images about their mean, averaged over the box: undeformed, and
    /// deformed onto the average.
    spread_before: f64,
    spread_after: f64,
}

/// The record of a result. The time is measured up to this call.
pub(super) fn record<const D: usize>(outcome: &Outcome<D>, start: Instant) -> Record<'_, D> {
    let result = &outcome.result;
    let found = Found {
        result,
        energy: result.energy(),
        weights: outcome.params.segmentation.weights,
        spread_before: spread(&result.images),
        spread_after: spread(&result.pushed),
    };
    let status = overall(
        result.status,
        result.levels.last().map(|level| level.status),
    );
    let grid = result.average.grid();
    let names = outcome.images.iter().map(|image| &*image.name);
    let doubts = named(&result.doubts(&outcome.params.average), names);
    Record::new(status, Some(grid), &outcome.config, found, doubts, start)
        .of(outcome.images.clone())
}

/// The summary of a result.
pub(super) fn summary<const D: usize>(record: &Record<'_, D>) -> Summary {
    let found = &record.body;
    let rounds: usize = found.result.levels.iter().map(|level| level.rounds).sum();
    let title = format!(
        "Edges of {} images and their average on {} nodes: {} after {rounds} rounds, {:.1} s",
        record.input.len(),
        record.grid(),
        record.state(),
        record.seconds
    );
    let mut summary = Summary::new(record, "average.png", title);
    summary.line("energy", format!("{:.6e}", found.energy.total));
    let (before, after) = (found.spread_before, found.spread_after);
    summary.line(
        "images",
        format!("standard deviation {before:.4} undeformed, {after:.4} deformed onto the average"),
    );
    summary.certificate(&found.result.certificate);
    summary
}
