//! The contents of `result.json` of a geodesic.

use std::time::Instant;

use ::geodesic::{Change, Contact, Form, Geodesic};
use levelset::Contour;
use serde::Serialize;

use super::error_bars::ErrorBars;
use super::minima::{FoundPaths, add_paths};
use super::path::Path;
use super::{GeodesicConfig, Outcome};
use crate::doubts::{DoubtRecord, named};
use crate::numbers::plural;
use crate::report::{self, overall, unless_cancelled};
use crate::shapes::{BoundaryRecord, Input, common_scale, records_of};
use crate::summary::Summary;

/// Everything in `result.json`.
pub(super) type Record<'a, const D: usize> = report::Record<GeodesicConfig, Found<'a, D>, D>;

/// The result.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Found<'a, const D: usize> {
    #[serde(flatten)]
    pub result: &'a Geodesic<D>,
    /// The labels of the components, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    labels: Vec<i64>,
    /// With several starts, these and the paths that were found.
    #[serde(flatten)]
    minima: Option<&'a FoundPaths>,
    /// With `--error-bars`, those of the length and the dissipation.
    #[serde(skip_serializing_if = "Option::is_none")]
    error_bars: Option<&'a ErrorBars>,
    /// Weight of one mismatch in the last minimisation.
    mismatch_weight_in_force: f64,
    /// `sum sqrt W_k`.
    pub length: f64,
    /// The same in the length units of the inputs: a length grows as the square root of a volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    length_input_units: Option<f64>,
    /// `K sum W_k`, at least the square of the length.
    pub dissipation: f64,
    /// Whether the end shape is reached: the boundaries agree but for small parts.
    pub end_reached: bool,
    /// Areas or volumes of the shapes `0, ..., K`.
    volumes: Vec<f64>,
    /// Lengths or areas of their boundaries.
    boundaries: Vec<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    volumes_input_units: Option<Vec<f64>>,
    /// Accepted steps on all levels.
    pub iterations: usize,
    /// Evaluations of the functional on all levels, with or without gradient.
    evaluations: usize,
    #[serde(flatten)]
    coordinates: BoundaryRecord,
    /// Seconds of the minimisation including the initial path.
    solver_seconds: f64,
}

/// The record of a result. The time is measured up to this call.
pub(super) fn record<'a, const D: usize>(
    outcome: &'a Outcome<D>,
    path: &Path<D>,
    coordinates: BoundaryRecord,
    start: Instant,
) -> Record<'a, D> {
    let (inputs, result) = (&outcome.inputs, &outcome.result);
    let scale = common_scale(inputs.iter().map(Input::scale));
    let unit = |scale: f64| scale.powi(D as i32);
    let levels = &result.levels;
    let found = Found {
        result,
        labels: outcome.labels.clone(),
        minima: outcome.minima.as_ref(),
        error_bars: outcome.error_bars.as_ref(),
        mismatch_weight_in_force: result
            .last_level()
            .map_or(0.0, |level| level.mismatch_weight),
        length: result.length(),
        length_input_units: scale.map(|scale| result.length() / unit(scale).sqrt()),
        dissipation: result.dissipation(),
        end_reached: result.end_reached(),
        volumes: path.sizes.clone(),
        boundaries: path.contours.iter().map(Contour::perimeter).collect(),
        volumes_input_units: scale
            .map(|scale| path.sizes.iter().map(|v| v / unit(scale)).collect()),
        iterations: levels.iter().map(|level| level.info.iterations).sum(),
        evaluations: levels.iter().map(|l| l.info.evaluations.energies()).sum(),
        coordinates,
        solver_seconds: outcome.solver_seconds,
    };
    let last = levels.last().map(|level| level.info.status);
    let last = FoundPaths::status(outcome.minima.as_ref(), last);
    let status = unless_cancelled(outcome.interrupted, overall(result.status, last));
    let grid = result.level_sets[0].grid();
    let mut doubts = named(&outcome.doubts, inputs.iter().map(|input| &*input.name));
    if outcome.config.params.form == Form::LevelSets {
        doubts = doubts.into_iter().map(DoubtRecord::of_level_sets).collect();
    }
    Record::new(status, Some(grid), &outcome.config, found, doubts, start).of(records_of(inputs))
}

/// Smaller angles of the rotation of a whole shape, in degrees, are not worth a line: bends have such, too.
const LEAST_ANGLE: f64 = 20.0;

/// The summary of a result.
pub(super) fn summary<const D: usize>(record: &Record<'_, D>) -> Summary {
    let (found, path) = (&record.body, record.body.result);
    let title = format!(
        "Geodesic of {} steps on {} nodes: {} after {} iterations, {:.1} s",
        path.energy.step_energies.len(),
        record.grid(),
        record.state(),
        found.iterations,
        record.seconds
    );
    let mut summary = Summary::new(record, "geodesic.png", title);
    summary.law(&record.parameters.params.law);
    let (length, dissipation) = (found.length, found.dissipation);
    summary.line(
        "length",
        format!(
            "{length:.6e}, squared {:.3e}, dissipation {dissipation:.3e}",
            length * length
        ),
    );
    if let Some(length) = found.length_input_units {
        summary.line("", format!("length {length:.4e} in units of the inputs"));
    }
    let dice = path.dice_end;
    summary.line(
        "end",
        format!(
            "Dice {dice:.4} of {}the end shape and the deformed start shape",
            if record.parameters.hides() {
                "what is visible of "
            } else {
                ""
            }
        ),
    );
    if let Some(arrival) = &path.arrival {
        summary.line(
            "",
            format!(
                "boundaries: 95 % within {:.2} spacings, all within {:.2}",
                arrival.percentile_95,
                arrival.missing.max(arrival.surplus)
            ),
        );
    }
    if let Some(angle) = path.rotation_degrees.filter(|angle| *angle >= LEAST_ANGLE) {
        let turned = format!("by {angle:.0} degrees as a whole, which costs nothing");
        summary.line("rotation", turned);
    }
    if let Some(changes) = changes_of_topology(&path.contacts) {
        summary.line("contacts", changes);
    }
    summary.certificate(&path.certificate);
    if let Some(minima) = found.minima {
        add_paths(&mut summary, minima);
    }
    if let Some(bars) = found.error_bars {
        bars.add_to(&mut summary);
    }
    summary
}

/// What merges and splits on the path, and the largest of it.
fn changes_of_topology(contacts: &[Contact]) -> Option<String> {
    let largest = contacts.first()?;
    let count = |change, one: &str| {
        let n = contacts.iter().filter(|c| c.change == change).count();
        let s = plural(n);
        (n > 0).then(|| format!("{n} {one}{s}"))
    };
    let counts = [count(Change::Merge, "merge"), count(Change::Split, "split")];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    let centre: Vec<String> = largest.centre.iter().map(|x| format!("{x:.2}")).collect();
    Some(format!(
        "{}; the largest at shape {}, around ({})",
        counts.join(", "),
        largest.step,
        centre.join(", ")
    ))
}
