//! The files of a result directory.

use fe_grid::ScalarField;
use levelset::{BoxEdge, Contour, Moments, contour};

use super::Outcome;
use super::draw::picture;
use super::record::{record, summary};
use crate::error::CliError;
use crate::input::Image;
use crate::output::energy::write_energy;
use crate::output::npy::{Precision, write_field, write_mask};
use crate::output::vti::VtiFile;
use crate::output::{OutputError, ResultDir, deformation, numbered};
use crate::session::Session;
use crate::shapes::write_surface;
use crate::summary::Summary;

/// Names of the terms of the energy.
const PARTS: [&str; 3] = ["elastic", "mismatch", "length"];

/// Writes everything, `result.json` last.
///
/// # Errors
/// [`CliError`]; the directory is incomplete then.
pub(super) fn write_all<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
    session: &Session<'_>,
) -> Result<Summary, CliError> {
    write_arrays(directory, outcome)?;
    write_vti(directory, outcome)?;
    let levels = &outcome.result.levels;
    write_energy(directory, &outcome.history, &PARTS, |level| {
        Some(levels.get(level)?.energy.parts.to_vec())
    })?;
    let outline = average_outline(outcome)?;
    picture(outcome, &outline)?.write_png(&directory.file("average.png"))?;
    let surface = write_surface(&directory.file("average.stl"), &outcome.inputs, &outline)?;
    let volume = Moments::of_contour(&outline);
    let record = record(outcome, volume, surface, session.start);
    record.write(directory)?;
    Ok(summary(&record, session.output))
}

/// Writes drawn inputs to the folder `inputs`.
///
/// # Errors
/// [`CliError::Output`].
pub(crate) fn write_inputs<const D: usize>(
    directory: &ResultDir,
    images: &[Image<D>],
) -> Result<(), CliError> {
    let folder = directory.file("inputs");
    std::fs::create_dir(&folder).map_err(OutputError::at(&folder))?;
    for image in images {
        let grid = fe_grid::Grid::with_nodes(image.size, 1.0)?;
        let field = ScalarField::from_vec(grid, image.values.clone())?;
        let name = image.path.file_name().unwrap_or_default();
        write_field(&folder.join(name), &field, Precision::Double)?;
    }
    Ok(())
}

/// The boundary of the average; the faces of the box close it.
fn average_outline<const D: usize>(outcome: &Outcome<D>) -> Result<Contour<D>, CliError> {
    let indicator = &outcome.result.average_indicator;
    Ok(contour(indicator, 0.5, BoxEdge::Closed).map_err(shape_average::AverageError::from)?)
}

fn write_arrays<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
) -> Result<(), CliError> {
    let result = &outcome.result;
    let grid = *result.average.grid();
    write_field(
        &directory.file("average.npy"),
        &result.average,
        Precision::Double,
    )?;
    let mask: Vec<bool> = result
        .average_mask
        .as_slice()
        .iter()
        .map(|&x| x > 0.5)
        .collect();
    write_mask(
        &directory.file("average_mask.npy"),
        &mask,
        &grid.nodes_per_axis(),
    )?;
    for (i, displacement) in result.displacements.iter().enumerate() {
        let path = directory.file(numbered("deformation", i, "npy"));
        write_field(&path, &deformation(displacement), Precision::Double)?;
    }
    let shapes = &result.shapes;
    for (i, phase_field) in shapes.phase_fields.iter().enumerate() {
        let path = directory.file(numbered("phasefield", i, "npy"));
        write_field(&path, phase_field, Precision::Double)?;
    }
    let stiffness = outcome.config.params.void_stiffness;
    for (i, indicator) in shapes.indicators.iter().enumerate() {
        let mut weight = indicator.clone();
        for x in weight.as_mut_slice() {
            *x = (1.0 - stiffness) * *x + stiffness;
        }
        write_field(
            &directory.file(numbered("weight", i, "npy")),
            &weight,
            Precision::Double,
        )?;
    }
    Ok(())
}

fn write_vti<const D: usize>(directory: &ResultDir, outcome: &Outcome<D>) -> Result<(), CliError> {
    let result = &outcome.result;
    let mut file = VtiFile::new(*result.average.grid(), Precision::Single)
        .field("average", &result.average)
        .field("mask", &result.average_mask);
    for (i, displacement) in result.displacements.iter().enumerate() {
        file = file.field(&format!("displacement_{i:03}"), displacement);
    }
    Ok(file.write(&directory.file("average.vti"))?)
}
