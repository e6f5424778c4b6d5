//! The files of a result directory.

use shapespace_report::table::{Table, exact, exact_or_empty};

use super::Outcome;
use super::draw::Sheets;
use super::map::Map;
use super::record::{Record, record};
use super::study::Distances;
use super::summary::summary;
use crate::error::CliError;
use crate::output::matrix::write_matrix_table;
use crate::output::{ResultDir, write_text};
use crate::session::Session;
use crate::summary::Summary;

/// Writes everything, `result.json` last.
///
/// # Errors
/// [`CliError`]; the directory is incomplete then.
pub(super) fn write_all<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
    session: &Session<'_>,
) -> Result<Summary, CliError> {
    let record = record(outcome, session.start);
    write_tables(directory, outcome, &record)?;
    let mut summary = summary(&record);
    if directory.has_files() {
        let sheets = Sheets::new(outcome);
        for (name, canvas) in sheets.draw(outcome) {
            directory.picture(name, || canvas)?;
        }
        summary.marks = sheets.into_marks();
    }
    record.write(directory)?;
    Ok(summary)
}

fn write_tables<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
    record: &Record<'_, D>,
) -> Result<(), CliError> {
    let (study, inputs) = (&outcome.study, &outcome.inputs);
    let names: Vec<String> = inputs.iter().map(|input| input.name.clone()).collect();
    // Only lengths of paths: the table could not distinguish them from the shortest ways through
    // other shapes.
    let entry = |distances: &Distances, i: usize, j: usize| distances.between.between(i, j);
    let (rows, columns) = (outcome.scope.rows(), outcome.scope.columns());
    let sides = [&names[rows.clone()], &names[columns.clone()]];
    for (name, distances) in [
        ("distances.csv", &study.distances),
        ("elastic.csv", &study.elastic),
    ] {
        directory.with_file(name, |path| {
            write_matrix_table(path, sides, |i, j| entry(distances, i, columns.start + j))
        })?;
    }
    directory.matrix("distances.npy", [rows.len(), columns.len()], |i, j| {
        entry(&study.distances, i, columns.start + j)
    })?;
    if let Some(neighbours) = &study.neighbours {
        let table = neighbours.table(&names, outcome.labels.as_ref());
        directory.with_file("neighbours.csv", |path| write_text(path, &table.csv()))?;
    }
    let mut table = Table::new([
        "start",
        "end",
        "length",
        "half_length",
        "elastic",
        "dice_end",
        "gap_end",
        "boundary_end",
        "missing_end",
        "surplus_end",
        "slits_end",
        "films_end",
        "status",
        "iterations",
        "evaluations",
        "refinements",
        "through",
        "seconds",
    ]);
    for path in &record.body.paths {
        table.texts([
            names[path.start].clone(),
            names[path.end].clone(),
            exact_or_empty(path.length),
            exact_or_empty(path.half_length),
            exact_or_empty(path.elastic),
            exact(path.dice_end),
            exact_or_empty(path.gap_end),
            exact_or_empty(path.arrival.map(|found| found.percentile_95)),
            exact_or_empty(path.arrival.map(|found| found.missing)),
            exact_or_empty(path.arrival.map(|found| found.surplus)),
            exact_or_empty(path.arrival.map(|found| found.slits)),
            exact_or_empty(path.arrival.map(|found| found.films)),
            path.status.clone(),
            path.iterations.to_string(),
            path.evaluations.to_string(),
            path.refinements.to_string(),
            path.through
                .map_or_else(String::new, |shape| names[shape].clone()),
            exact(path.seconds),
        ]);
    }
    directory.with_file("paths.csv", |path| write_text(path, &table.csv()))?;
    write_embedding(directory, outcome, &names)
}

fn write_embedding<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
    names: &[String],
) -> Result<(), CliError> {
    let Some(map) = &outcome.study.map else {
        return Ok(());
    };
    let (of_map, more): (&[&str], Vec<Vec<String>>) = match map {
        Map::Whole { classical, .. } => {
            let places = classical.points.iter();
            let places = places.map(|p| p.map(exact).to_vec());
            (&["classical_x", "classical_y"], places.collect())
        }
        Map::Landmarks(map) => {
            let all = 0..names.len();
            let is = |shape: usize| usize::from(map.landmarks.contains(&shape));
            (
                &["landmark"],
                all.map(|shape| vec![is(shape).to_string()]).collect(),
            )
        }
    };
    let clusters = outcome.study.distances.completed.as_ref();
    let first = ["name", "class", "cluster", "x", "y"];
    let mut table = Table::new(first.into_iter().chain(of_map.iter().copied()));
    for ((i, name), more) in names.iter().enumerate().zip(more) {
        let labels = outcome.labels.as_ref();
        let class = labels.and_then(|labels| labels.name(i)).unwrap_or_default();
        let cluster = clusters.map_or_else(String::new, |c| c.labels[i].to_string());
        let words = [name.clone(), class.into(), cluster];
        let place = map.points()[i].map(exact);
        table.texts(words.into_iter().chain(place).chain(more));
    }
    Ok(directory.with_file("embedding.csv", |path| write_text(path, &table.csv()))?)
}
