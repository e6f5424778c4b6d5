//! The arrays and tables of a comparison.

use shapespace_report::table::{Table, exact};

use super::record::differences;
use super::source::Kind;
use super::tests::{Found, OfModes, Outcome, Predicted};
use crate::error::CliError;
use crate::output::names::{BOUNDARY, DIFFERENCE, RATE};
use crate::output::surface::PointArray;
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
    write(&format!("{BOUNDARY}.csv"), &boundary(outcome, found))?;
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
    let units = outcome.compared.units();
    let columns = columns(outcome, found);
    let names = columns.iter().map(|(name, _)| name.clone());
    let mut table = Table::new(units.axes().chain(names));
    for (q, p) in units.placed(&found.outline).points().iter().enumerate() {
        let numbers = columns.iter().map(|(_, values)| values[q]);
        table.texts(p.iter().copied().chain(numbers).map(exact));
    }
    table
}

/// What is known at every point of the boundary, with the name of each column.
fn columns<const D: usize>(outcome: &Outcome<D>, found: &OfModes<D>) -> Vec<(String, Vec<f64>)> {
    let (units, points) = (outcome.compared.units(), &found.points);
    let lengths = |values: &[f64]| values.iter().map(|x| units.length(*x)).collect();
    let mut columns: Vec<(String, Vec<f64>)> = vec![
        ("f".into(), points.f.clone()),
        ("p_value".into(), points.p_value.clone()),
        (RATE.into(), points.false_discovery_rate.clone()),
        (
            "p_value_family_wise".into(),
            points.p_value_family_wise.clone(),
        ),
    ];
    let differences = differences(&found.displacements);
    columns.push((units.column(DIFFERENCE), lengths(&differences)));
    let means = outcome.compared.labelled.names.iter();
    for (name, mean) in means.zip(&found.displacements) {
        let name = format!("{} of {name}", units.column("displacement"));
        columns.push((name, lengths(mean)));
    }
    columns
}

/// The boundary of the average with all of it, the means of the groups, and the shapes that covariates predict.
pub(super) fn boundaries<const D: usize>(
    outcome: &Outcome<D>,
    directory: &ResultDir,
) -> Result<(), CliError> {
    let (Found::Modes(found), Kind::Modes(stored, _)) = (&outcome.found, &outcome.compared.kind)
    else {
        return Ok(());
    };
    let columns = columns(outcome, found);
    let arrays: Vec<PointArray<'_>> = columns
        .iter()
        .map(|(name, values)| PointArray {
            name,
            components: 1,
            values,
        })
        .collect();
    let units = outcome.compared.units();
    units
        .place()
        .write_with(directory, BOUNDARY, &found.outline, &arrays)?;
    let place = &stored.average.place;
    for (g, mean) in found.means.iter().enumerate() {
        place.write(directory, &format!("mean_{g:03}"), &mean.outline)?;
    }
    let predicted = found.covariates.iter().flat_map(|found| &found.shapes);
    for (k, shape) in predicted.enumerate() {
        place.write(directory, &format!("predicted_{k:03}"), &shape.outline)?;
    }
    Ok(())
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
