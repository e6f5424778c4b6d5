//! The contents of `result.json` of a comparison.

use std::time::Instant;

use levelset::{Cause, Doubt};
use serde::Serialize;
use shape_pca::groups::{Classification, Permanova, Regression, ScoreTests};

use super::CompareConfig;
use super::source::Kind;
use super::tests::{Found, OfModes, Outcome};
use crate::doubts::{named, of_repeated, of_source};
use crate::groups::{GroupsRecord, LeftOut};
use crate::report;
use crate::shapes::WorldFrame;
use crate::summary::Summary;

/// Everything in `result.json`.
pub(super) type Record<'a, const D: usize> = report::Record<CompareConfig, Body<'a>, D>;

/// The result.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Body<'a> {
    /// The shapes of the result.
    shapes: &'a [String],
    #[serde(flatten)]
    groups: GroupsRecord<'a>,
    /// Columns that are no covariates.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    covariates_left_out: &'a [LeftOut],
    /// Number of modes that are compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    n_modes: Option<usize>,
    /// Tests of the scores.
    #[serde(skip_serializing_if = "Option::is_none")]
    scores: Option<&'a ScoreTests>,
    /// The test of the distances.
    #[serde(skip_serializing_if = "Option::is_none")]
    distances: Option<&'a Permanova>,
    /// Tests at the points of the boundary of the average.
    #[serde(skip_serializing_if = "Option::is_none")]
    boundary: Option<Boundary>,
    /// Regressions of the scores.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    covariates: Vec<OfCovariate<'a>>,
    /// Every shape assigned by the others.
    #[serde(skip_serializing_if = "Option::is_none")]
    classification: Option<&'a Classification>,
    /// The name of the group to which every shape is assigned.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    assigned_group: Vec<&'a str>,
}

/// Where groups differ.
#[derive(Clone, Debug, Serialize)]
struct Boundary {
    points: usize,
    /// The share of the points with a false discovery rate up to the limit.
    different_share: f64,
    /// The least p-value with control of the family-wise error.
    least_p_value_family_wise: f64,
    /// The largest distance between the means of two groups along the normal, in length units of the
    /// unit box.
    largest_difference: f64,
    /// The same in millimetres, where the result lies in the world.
    #[serde(skip_serializing_if = "Option::is_none")]
    largest_difference_mm: Option<f64>,
}

#[derive(Clone, Debug, Serialize)]
struct OfCovariate<'a> {
    name: &'a str,
    least: f64,
    mean: f64,
    greatest: f64,
    #[serde(flatten)]
    regression: &'a Regression,
}

/// The record of a result. The time is measured up to this call.
pub(super) fn record<'a, const D: usize>(
    config: &CompareConfig,
    outcome: &'a Outcome<D>,
    start: Instant,
) -> Record<'a, D> {
    let compared = &outcome.compared;
    let labelled = &compared.labelled;
    let modes = match &outcome.found {
        Found::Modes(found) => Some(&**found),
        Found::Distances(_) => None,
    };
    let name = |label: &usize| &*labelled.names[*label];
    let (grid, world) = match &compared.kind {
        Kind::Modes(stored, _) => (
            Some(stored.space.object.grid()),
            stored.average.world.as_ref(),
        ),
        Kind::Distances(_) => (None, None),
    };
    let body = Body {
        shapes: &compared.names,
        groups: labelled.record(|group| modes.map(|found| &*found.means[group].scores)),
        covariates_left_out: &labelled.left_out,
        n_modes: modes.map(|found| found.tests.f.len()),
        scores: modes.map(|found| &found.tests),
        distances: match &outcome.found {
            Found::Distances(found) => Some(found),
            Found::Modes(_) => None,
        },
        boundary: modes.map(|found| boundary(found, config.discovery_rate, world)),
        covariates: modes.map_or_else(Vec::new, |found| {
            let all = found.covariates.iter();
            all.map(|c| OfCovariate {
                name: &c.name,
                least: c.values[0],
                mean: c.values[1],
                greatest: c.values[2],
                regression: &c.regression,
            })
            .collect()
        }),
        classification: modes.map(|found| &found.classification),
        assigned_group: modes.map_or_else(Vec::new, |found| {
            found.classification.assigned.iter().map(name).collect()
        }),
    };
    let least = match &outcome.found {
        Found::Modes(found) => found.tests.least_p_value,
        Found::Distances(found) => found.least_p_value,
    };
    let doubts = [
        Doubt::check(Cause::GroupSizes, least),
        of_source(&compared.doubts),
    ];
    let repeated = of_repeated(compared.sums.iter().map(Option::as_deref));
    let doubts: Vec<Doubt> = doubts.into_iter().flatten().chain(repeated).collect();
    let doubts = named(&doubts, compared.names.iter().map(|name| &**name));
    Record::new("complete", grid, config, body, doubts, start).within(world)
}

fn boundary<const D: usize>(
    found: &OfModes<D>,
    rate: f64,
    world: Option<&WorldFrame<D>>,
) -> Boundary {
    let largest = differences(&found.displacements)
        .into_iter()
        .fold(0.0, f64::max);
    let rates = &found.points.false_discovery_rate;
    let different = rates.iter().filter(|r| **r <= rate).count();
    let least = found.points.p_value_family_wise.iter().copied();
    Boundary {
        points: rates.len(),
        different_share: different as f64 / rates.len().max(1) as f64,
        least_p_value_family_wise: least.fold(1.0, f64::min),
        largest_difference: largest,
        largest_difference_mm: world.map(|world| world.length() * largest),
    }
}

/// The largest difference between two groups at every point.
pub(super) fn differences(means: &[Vec<f64>]) -> Vec<f64> {
    let points = means.first().map_or(0, Vec::len);
    let range = |q: usize| {
        let values = || means.iter().map(|row| row[q]);
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    (0..points).map(range).collect()
}

/// The summary of a comparison.
pub(super) fn summary<const D: usize>(record: &Record<'_, D>, outcome: &Outcome<D>) -> Summary {
    let body = &record.body;
    let groups = &body.groups.groups;
    let sizes: Vec<String> = groups
        .iter()
        .map(|g| format!("{} {}", g.n_shapes, g.name))
        .collect();
    let title = format!(
        "Comparison of {} groups ({}), {:.1} s",
        groups.len(),
        sizes.join(", "),
        record.seconds
    );
    let mut summary = Summary::new(record, "compare.png", title);
    if let Some(found) = body.distances {
        summary.line(
            "distances",
            format!(
                "p = {:.4}, F = {:.3}, {:.1} % of the variance between the groups",
                found.p_value,
                found.f,
                100.0 * found.explained
            ),
        );
    }
    if let Some(found) = body.scores {
        summary.line(
            "all modes",
            format!(
                "p = {:.4}, F = {:.3}, {:.1} % of the variance between the groups",
                found.p_value_overall,
                found.f_overall,
                100.0 * found.explained
            ),
        );
        let p = found.p_value_family_wise.iter().take(6);
        let p: Vec<String> = p.map(|p| format!("{p:.4}")).collect();
        summary.line(
            "each mode",
            format!("p = {}, of the largest F of all", p.join(" ")),
        );
    }
    if let Some(found) = &body.boundary {
        let rate = record.parameters.discovery_rate;
        let share = 100.0 * found.different_share;
        // No rate is below the least p-value.
        let beyond = body.scores.map(|scores| scores.least_p_value);
        let beyond = beyond
            .filter(|least| *least > rate)
            .map_or_else(String::new, |least| {
                format!(": none could, with p-values of {least:.3} and more")
            });
        summary.line(
            "boundary",
            format!(
                "{share:.1} % of {} points differ (false discovery rate {rate}){beyond}",
                found.points
            ),
        );
    }
    for found in &body.covariates {
        let of_modes = found.regression.p_value_family_wise.iter().copied();
        summary.line(
            found.name,
            format!(
                "p = {:.4} of all modes, R2 = {:.3}; {:.4} of the mode that shows it best",
                found.regression.p_value_overall,
                found.regression.r_squared_overall,
                of_modes.fold(1.0, f64::min)
            ),
        );
    }
    for column in body.covariates_left_out {
        summary.line(&column.name, format!("is no covariate: {}", column.reason));
    }
    if let Some(found) = body.classification {
        summary.line(
            "left out",
            format!(
                "{:.1} % assigned to their group (mean of the groups, {} modes), p = {:.4}",
                100.0 * found.balanced_accuracy,
                found.modes,
                found.p_value
            ),
        );
    }
    if let (Found::Distances(_), true) = (
        &outcome.found,
        !outcome.compared.labelled.covariates.is_empty(),
    ) {
        summary.line("covariates", "need the scores of `shapespace pca`");
    }
    summary
}
