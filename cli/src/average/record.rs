//! The contents of `result.json` of an average.

use std::path::Path;
use std::time::Instant;

use levelset::Hausdorff;
use serde::Serialize;
use shape_average::{AverageResult, MemoryEstimate, StrainRanges};

use super::components::{ComponentRecord, labels_of};
use super::error_bars::ErrorBars;
use super::minima::{FoundMinima, add_minima, doubts as doubts_of_starts};
use super::{AverageConfig, Outcome};
use crate::doubts::named_by_label;
use crate::report::{self, overall, unless_cancelled};
use crate::shapes::{BoundaryRecord, Input, SizeRecord, common_scale, doubts_of, records_of};
use crate::summary::Summary;

/// Everything in `result.json`.
pub(super) type Record<'a, const D: usize> = report::Record<AverageConfig, Found<'a, D>, D>;

/// The result.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Found<'a, const D: usize> {
    #[serde(flatten)]
    pub result: &'a AverageResult<D>,
    /// Accepted steps on all levels.
    pub iterations: usize,
    /// Evaluations of the functional on all levels, with or without gradient.
    evaluations: usize,
    /// Evaluations of one shape's part of the functional on all levels.
    shape_evaluations: usize,
    pub mean_dice: f64,
    /// In length units of the unit box.
    hausdorff: Vec<Distance>,
    /// In the length units of each input.
    hausdorff_input_units: Vec<Distance>,
    average: SizeRecord,
    /// With --labels, in the order of the labels.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub components: Vec<ComponentRecord<'a>>,
    #[serde(flatten)]
    boundaries: BoundaryRecord,
    /// Ranges of `|D phi|`, `|cof D phi|` and `det D phi` over the cells of each shape.
    strain: Vec<Option<StrainRanges>>,
    /// With --error-bars, unless the grid is too coarse.
    #[serde(skip_serializing_if = "Option::is_none")]
    error_bars: Option<&'a ErrorBars>,
    /// With --starts.
    #[serde(flatten)]
    minima: Option<&'a FoundMinima>,
    /// Estimated bytes by purpose.
    memory_estimate: MemoryEstimate,
}

/// The distance between two boundaries, empty if one of them does not exist.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(untagged)]
pub(super) enum Distance {
    Known(Hausdorff),
    Unknown {},
}

/// The record of a result whose average has this area or volume, and these components. The time is
/// measured up to this call.
pub(super) fn record<'a, const D: usize>(
    outcome: &'a Outcome<D>,
    (volume, components): (f64, Vec<ComponentRecord<'a>>),
    boundaries: BoundaryRecord,
    strain: Vec<Option<StrainRanges>>,
    start: Instant,
) -> Record<'a, D> {
    let (inputs, result) = (&outcome.inputs, &outcome.result);
    let levels = &result.levels;
    let found = Found {
        result,
        iterations: levels.iter().map(|level| level.iterations).sum(),
        evaluations: levels.iter().map(|l| l.evaluations.energies()).sum(),
        shape_evaluations: result.shape_evaluations(),
        mean_dice: result.mean_dice(),
        hausdorff: distances(&result.hausdorff, |_| 1.0),
        hausdorff_input_units: distances(&result.hausdorff, |i| inputs[i].scale()),
        average: SizeRecord::new::<D>(volume, common_scale(inputs.iter().map(Input::scale))),
        components,
        boundaries,
        strain,
        error_bars: outcome.error_bars.as_ref(),
        minima: outcome.minima.as_ref(),
        memory_estimate: outcome.memory,
    };
    let last = levels.last().map(|level| level.status);
    let last = FoundMinima::status(outcome.minima.as_ref(), last);
    let status = unless_cancelled(outcome.interrupted, overall(result.status, last));
    let grid = result.average.grid();
    let mut doubts = [doubts_of(inputs), result.doubts(&outcome.config.params)].concat();
    doubts.extend(outcome.minima.iter().flat_map(doubts_of_starts));
    let names = inputs.iter().map(|input| &*input.name);
    let doubts = named_by_label(&doubts, names, labels_of(outcome));
    Record::new(status, Some(grid), &outcome.config, found, doubts, start).of(records_of(inputs))
}

/// Distances divided by the scales of their shapes.
pub(super) fn distances(
    found: &[Option<Hausdorff>],
    scale: impl Fn(usize) -> f64,
) -> Vec<Distance> {
    let of = |(i, distance): (usize, &Option<Hausdorff>)| match distance {
        Some(distance) => Distance::Known(Hausdorff {
            maximum: distance.maximum / scale(i),
            percentile_95: distance.percentile_95 / scale(i),
            mean: distance.mean / scale(i),
        }),
        None => Distance::Unknown {},
    };
    found.iter().enumerate().map(of).collect()
}

/// The summary of a result in this directory.
pub(super) fn summary<const D: usize>(record: &Record<'_, D>, target: &Path) -> Summary {
    let (params, found) = (&record.parameters.params, &record.body);
    let title = format!(
        "Average of {} shapes on {} nodes: {} after {} iterations, {:.1} s",
        record.input.len(),
        record.grid(),
        record.state(),
        found.iterations,
        record.seconds
    );
    let mut summary = Summary::new(record, "average.png", title);
    summary.law(&params.law);
    let energy = &found.result.energy;
    let (total, [elastic, mismatch, length]) = (energy.total, energy.parts);
    summary.line(
        "energy",
        format!(
            "{total:.6e} = elastic {elastic:.3e} + mismatch {mismatch:.3e} + length {length:.3e}"
        ),
    );
    summary.line(
        if D == 2 { "area" } else { "volume" },
        found.average.in_words(record.world.is_some()),
    );
    let overlaps = found.result.dice.iter().enumerate();
    if let Some((worst, least)) = overlaps.min_by(|a, b| a.1.total_cmp(b.1)) {
        let path = record.input[worst].path.display();
        let mean = found.mean_dice;
        summary.line(
            "overlap",
            format!("Dice {mean:.4} on average, {least:.4} at least ({path})"),
        );
    }
    for component in &found.components {
        summary.line("", component.in_words());
    }
    let rematched = found
        .result
        .levels
        .iter()
        .flat_map(|level| &level.rematched);
    let names: Vec<String> = rematched
        .map(|rematch| {
            let name = |shape: usize| record.input[shape].path.display();
            format!(
                "{} by way of {}",
                name(rematch.shape),
                name(rematch.by_way_of)
            )
        })
        .collect();
    if !names.is_empty() {
        summary.line("deformed", format!("anew: {}", names.join(", ")));
    }
    summary.certificate(&found.result.certificate);
    if let Some(bars) = found.error_bars {
        bars.add_to(&mut summary);
    }
    if let Some(minima) = found.minima {
        add_minima(&mut summary, minima);
    }
    if record.cancelled() {
        summary.line("to continue", format!("--start {}", target.display()));
    }
    summary
}
