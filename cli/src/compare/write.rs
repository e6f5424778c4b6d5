//! The arrays and tables of a comparison.

use shapespace_report::table::{Table, exact};

use super::record::differences;
use super::tests::{Found, OfModes, Outcome, Predicted};
use crate::error::CliError;
use crate::output::{ResultDir, write_text};

/// The mean shapes of the groups, `mean_000.npy` and so on, and those at the least, mean and greatest value
/// of every covariate, `predicted_000.npy` and so on.
pub(super) fn arrays<const D: usize>(
    outcome: &Outcome<D>,
    directory: &ResultDir,
) -> Result<(), CliError> {
    let Found::Modes(found) = &outcome.found else {
        return Ok(());
    };
    let level_sets = |shapes: &'_ [Predicted<D>]| -> Vec<_> {
        shapes.iter().map(|shape| shape.level_set.clone()).collect()
    };
    directory.arrays("mean", 0, &level_sets(&found.means))?;
    for (k, covariate) in found.covariates.iter().enumerate() {
        directory.arrays("predicted", 3 * k, &level_sets(&covariate.shapes))?;
    }
    Ok(())
}

/// `modes.csv`, `boundary.csv` and `shapes.csv`.
pub(super) fn tables<const D: usize>(
    outcome: &Outcome<D>,
    directory: &ResultDir,
) -> Result<(), CliError> {
    let Found::Modes(found) = &outcome.found else {
        return Ok(());
    };
    let write = |name: &str, table: &Table| {
        directory.with_file(name, |path| write_text(path, &table.csv()))
    };
    write("modes.csv", &modes(outcome, found))?;
    write("boundary.csv", &boundary(outcome, found))?;
    write("shapes.csv", &shapes(outcome, found))?;
    Ok(())
}

/// The tests of every mode.
fn modes<const D: usize>(outcome: &Outcome<D>, found: &OfModes<D>) -> Table {
    let mut head: Vec<String> = ["mode", "f", "p_value", "p_value_family_wise"]
        .map(String::from)
        .to_vec();
    let names = &outcome.compared.labelled.names;
    head.extend(names.iter().map(|name| format!("mean of {name}")));
    for covariate in &found.covariates {
        let name = &covariate.name;
        head.extend(["slope", "r_squared", "p_value"].map(|what| format!("{what} of {name}")));
    }
    let mut table = Table::new(head);
    let tests = &found.tests;
    for j in 0..tests.f.len() {
        let mut row = vec![tests.f[j], tests.p_value[j], tests.p_value_family_wise[j]];
        row.extend(found.means.iter().map(|mean| mean.scores[j]));
        for covariate in &found.covariates {
            let of = &covariate.regression;
            row.extend([of.slope[j], of.r_squared[j], of.p_value[j]]);
        }
        table.texts(
            [j.to_string()]
                .into_iter()
                .chain(row.into_iter().map(exact)),
        );
    }
    table
}

/// The tests at every point of the boundary of the average.
fn boundary<const D: usize>(outcome: &Outcome<D>, found: &OfModes<D>) -> Table {
    let mut head: Vec<String> = ["x", "y", "z"]
        .into_iter()
        .take(D)
        .map(String::from)
        .collect();
    let tests = [
        "f",
        "p_value",
        "false_discovery_rate",
        "p_value_family_wise",
        "difference",
    ];
    head.extend(tests.map(String::from));
    let names = &outcome.compared.labelled.names;
    head.extend(names.iter().map(|name| format!("displacement of {name}")));
    let mut table = Table::new(head);
    let differences = differences(&found.displacements);
    let points = &found.points;
    for (q, p) in found.outline.points().iter().enumerate() {
        let mut row = p.to_vec();
        row.extend([
            points.f[q],
            points.p_value[q],
            points.false_discovery_rate[q],
        ]);
        row.extend([points.p_value_family_wise[q], differences[q]]);
        row.extend(found.displacements.iter().map(|mean| mean[q]));
        table.texts(row.into_iter().map(exact));
    }
    table
}

/// The group of every shape, and the one to which it is assigned.
fn shapes<const D: usize>(outcome: &Outcome<D>, found: &OfModes<D>) -> Table {
    let compared = &outcome.compared;
    let (names, groups) = (&compared.labelled.names, &compared.labelled.groups);
    let mut table = Table::new(["shape", "group", "assigned"]);
    let assigned = groups.labels().iter().zip(&found.classification.assigned);
    for (shape, (&own, &other)) in compared.names.iter().zip(assigned) {
        table.texts([shape.clone(), names[own].clone(), names[other].clone()]);
    }
    table
}
