//! A plot for every statement that has an order.

use std::fs;

use shapespace_verify::record::{StatementRecord, VerifyRecord};
use shapespace_verify::report::Plot;

use crate::output::convergence::{Errors, convergence_plot};
use crate::output::{OutputError, ResultDir};

const SIZE: (u32, u32) = (560, 380);

/// Writes `plots/NAME.svg`, and returns the pictures for the report.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn write_plots(
    directory: &ResultDir,
    record: &VerifyRecord,
) -> Result<Vec<Plot>, OutputError> {
    let folder = directory.file("plots");
    fs::create_dir(&folder).map_err(OutputError::at(&folder))?;
    let mut plots = Vec::new();
    for statement in &record.statements {
        let Some(svg) = plot(statement) else { continue };
        let path = folder.join(format!("{}.svg", statement.name));
        let svg = svg.map_err(|e| OutputError::at(&path)(std::io::Error::other(e)))?;
        fs::write(&path, &svg).map_err(OutputError::at(&path))?;
        plots.push(Plot {
            name: statement.name,
            svg,
        });
    }
    Ok(plots)
}

fn plot(statement: &StatementRecord) -> Option<Result<String, String>> {
    let lines: Vec<_> = statement
        .lines
        .iter()
        .filter(|line| line.points.len() > 1)
        .collect();
    // Where the axes are not the same for all, each is named in its own words.
    let mut axes: Vec<&str> = lines.iter().map(|line| line.axis.as_str()).collect();
    axes.dedup();
    let errors: Vec<Errors> = lines
        .iter()
        .map(|line| Errors {
            label: &line.label,
            points: &line.points,
            order: line.order,
        })
        .collect();
    (!errors.is_empty()).then(|| convergence_plot(SIZE, statement.name, &axes.join(", "), &errors))
}
