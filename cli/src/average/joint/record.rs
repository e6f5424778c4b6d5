//! The contents of `result.json`, and the summary. Missing values are left out.

use std::io::Write as _;
use std::path::Path;

use phasefield::segmentation::Weights;
use serde::Serialize;
use shape_average::joint::{JointEnergy, JointResult, spread};

use super::{AverageConfig, Outcome};
use crate::report::{self, certified, overall};
use crate::shapes::InputRecord;

/// Everything in `result.json`.
pub(super) type Record<'a, const D: usize> = report::Record<AverageConfig, Found<'a, D>, D>;

/// What was found.
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
pub(super) fn record<const D: usize>(outcome: &Outcome<D>) -> Record<'_, D> {
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
    let nodes = result.average.grid().nodes_per_axis();
    let images = outcome.images.iter();
    Record::new(status, &nodes, &outcome.config, found, outcome.start).of(images
        .map(|image| {
            InputRecord::of_image(
                &image.path,
                &image.name,
                image.size,
                image.range,
                image.frame,
            )
        })
        .collect())
}

/// Prints a short summary; the last line names the picture.
pub(super) fn print<const D: usize>(record: &Record<'_, D>, target: &Path) {
    let found = &record.body;
    let nodes: Vec<String> = record.nodes.iter().map(ToString::to_string).collect();
    let rounds: usize = found.result.levels.iter().map(|level| level.rounds).sum();
    let file = |name: &str| target.join(name).display().to_string();
    let text = format!(
        "Edges of {} images and their average on {} nodes: {} after {rounds} rounds, {:.1} s\n  \
             energy       {:.6e}\n  \
             images       differ by {:.4} as they are, by {:.4} brought onto each other\n  \
             deformation  {}, determinant at least {:.3e}\n  \
             results      {}\n  \
             picture      {}\n",
        record.input.len(),
        nodes.join(" x "),
        record.status.replace('_', " "),
        record.seconds,
        found.energy.total,
        found.spread_before,
        found.spread_after,
        certified(&found.result.certificate),
        found.result.certificate.min_det,
        file("result.json"),
        file("average.png"),
    );
    // A closed standard output is not an error.
    let _ = std::io::stdout().write_all(text.as_bytes());
}
