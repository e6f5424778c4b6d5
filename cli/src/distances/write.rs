//! The files of a result directory.

use super::Outcome;
use super::draw::{Draw, Pictures, Sheets};
use super::record::{Record, record};
use super::study::Distances;
use crate::error::CliError;
use crate::output::WorkDir;
use crate::output::matrix::{write_lines, write_matrix_array, write_matrix_table};

/// Writes everything, `result.json` last, and returns what is in it.
///
/// # Errors
/// [`CliError`]; the directory is not complete then.
pub(super) fn write_all<const D: usize>(
    directory: &WorkDir,
    outcome: &Outcome<D>,
) -> Result<Record<D>, CliError>
where
    Pictures: Draw<D>,
{
    let record = record(outcome);
    write_tables(directory, outcome, &record)?;
    let sheets = Sheets::new::<D, Pictures>(outcome);
    for (name, canvas) in sheets.draw(outcome) {
        canvas.write_png(&directory.file(name))?;
    }
    record.write(directory.path())?;
    Ok(record)
}

fn write_tables<const D: usize>(
    directory: &WorkDir,
    outcome: &Outcome<D>,
    record: &Record<D>,
) -> Result<(), CliError> {
    let (study, inputs) = (&outcome.study, &outcome.inputs);
    let names: Vec<String> = inputs.iter().map(|input| input.name.clone()).collect();
    // Only what was measured: an entry by way of other shapes has no place in a table of numbers
    // that does not tell them apart.
    let entry = |distances: &Distances, i: usize, j: usize| distances.between.between(i, j);
    for (name, distances) in [
        ("distances.csv", &study.distances),
        ("elastic.csv", &study.elastic),
    ] {
        write_matrix_table(&directory.file(name), &names, |i, j| entry(distances, i, j))?;
    }
    write_matrix_array(&directory.file("distances.npy"), names.len(), |i, j| {
        entry(&study.distances, i, j)
    })?;
    let number = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:e}"));
    let lines: Vec<Vec<String>> = record
        .body
        .paths
        .iter()
        .map(|path| {
            vec![
                names[path.start].clone(),
                names[path.end].clone(),
                number(path.length),
                number(path.half_length),
                number(path.elastic),
                number(Some(path.dice_end)),
                path.status.clone(),
                number(Some(path.seconds)),
            ]
        })
        .collect();
    write_lines(
        &directory.file("paths.csv"),
        "start,end,length,half_length,elastic,dice_end,status,seconds",
        &lines,
    )?;
    write_embedding(directory, outcome, &names)
}

fn write_embedding<const D: usize>(
    directory: &WorkDir,
    outcome: &Outcome<D>,
    names: &[String],
) -> Result<(), CliError> {
    let study = &outcome.study;
    let (Some(groups), Some(completed)) = (&study.groups, &study.distances.completed) else {
        return Ok(());
    };
    let lines: Vec<Vec<String>> = names
        .iter()
        .enumerate()
        .map(|(i, name)| {
            let classes = outcome.classes.as_ref();
            let class = classes.map_or("", |c| c.names[c.of_input[i]].as_str());
            let [x, y] = groups.refined.points[i];
            let [u, v] = groups.classical.points[i];
            let numbers = [x, y, u, v].map(|number| format!("{number:e}"));
            [name.clone(), class.into(), completed.labels[i].to_string()]
                .into_iter()
                .chain(numbers)
                .collect()
        })
        .collect();
    let head = "name,class,cluster,x,y,classical_x,classical_y";
    Ok(write_lines(&directory.file("embedding.csv"), head, &lines)?)
}
