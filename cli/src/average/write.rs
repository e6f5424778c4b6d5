//! The files of a result directory.

use std::path::Path;

use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, Contour, Moments, contour};

use super::Outcome;
use super::components::{
    average_outlines, label_field, labels_of, write_components, write_phase_fields,
};
use super::draw::picture;
use super::record::{record, summary};
use super::strain::{self, Strains, write_maps};
use crate::error::CliError;
use crate::output::energy::write_energy;
use crate::output::npy::Precision;
use crate::output::vti::VtiFile;
use crate::output::{OutputError, ResultDir};
use crate::session::Session;
use crate::shapes::{WorldFrame, write_curves, write_surface};
use crate::summary::Summary;
use crate::warp::{Space, write_shape, write_warps};
use shapespace_input::Image;

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
    let levels = &outcome.result.levels;
    write_energy(directory, &outcome.history, &PARTS, |level| {
        Some(levels.get(level)?.energy.parts.to_vec())
    })?;
    let (displacements, shapes) = (&outcome.result.displacements, &outcome.result.shapes);
    let strains = Strains::new(displacements, &shapes.indicators);
    write_maps(directory, outcome.result.average.grid(), &strains.maps)?;
    directory.picture("strain.png", || {
        strain::picture(&outcome.inputs, displacements, &strains)
    })?;
    let outline = average_outline(outcome)?;
    let parts = average_outlines(outcome)?;
    directory.with_file("average.png", |path| {
        let picture = picture(outcome, &outline, &parts)?.write_png(path);
        picture.map_err(|source| CliError::from(OutputError::at(path)(source)))
    })?;
    let extensions = ["stl", "ply", "vtp"];
    let surface = write_surface(directory, "average", &extensions, &outcome.inputs, &outline)?;
    let curves = write_curves(directory, "average_outline", &outcome.inputs, &outline)?;
    let grid = *outcome.result.average.grid();
    write_shape(directory, "average", &outcome.inputs, &outline, grid)?;
    write_components(directory, outcome, &outline, &parts)?;
    let space = Space::of_inputs(directory, &outcome.inputs);
    let of_input = |number| Space::of_input(&outcome.inputs, number);
    write_warps(directory, space, of_input, displacements)?;
    let volume = Moments::of_contour(&outline);
    let strains = strains.ranges();
    let record = record(outcome, volume, [surface, curves], strains, session.start);
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
        let grid = Grid::with_nodes(image.size, 1.0)?;
        let field = ScalarField::from_vec(grid, image.values.to_vec())?;
        let name = image.path.file_name().unwrap_or_default();
        directory.array(Path::new("inputs").join(name), &field)?;
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
    let (result, shapes) = (&outcome.result, &outcome.result.shapes);
    directory.array("average.npy", &result.average)?;
    directory.object("average_mask.npy", &result.average_mask, 0.5)?;
    directory.deformations("deformation", 0, &result.displacements)?;
    write_phase_fields(directory, outcome)?;
    let stiffness = outcome.config.params.void_stiffness;
    let weight = |indicator: &ScalarField<f64, D>| {
        let mut weight = indicator.clone();
        for x in weight.as_mut_slice() {
            *x = (1.0 - stiffness) * *x + stiffness;
        }
        weight
    };
    let weights: Vec<_> = shapes.indicators.iter().map(weight).collect();
    directory.arrays("weight", 0, &weights)?;
    let labels = (!labels_of(outcome).is_empty()).then(|| label_field(outcome));
    Ok(directory.with_file("average.vti", |path| {
        let mut file = VtiFile::new(*result.average.grid(), Precision::Single)
            .within(WorldFrame::of_inputs(&outcome.inputs))
            .field("average", &result.average)
            .field("mask", &result.average_mask);
        if let Some(labels) = &labels {
            file = file.field("labels", labels);
        }
        file.fields("displacement", &result.displacements)
            .write(path)
    })?)
}
