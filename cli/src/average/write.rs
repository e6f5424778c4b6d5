//! The files of a result directory.

use std::path::Path;

use fe_grid::{Field, Grid, ScalarField};
use levelset::{BoxEdge, Contour, contour, enclosed_volume};

use super::Outcome;
use super::components::{
    average_outlines, label_field, labels_of, records, write_components, write_phase_fields,
};
use super::draw::picture;
use super::record::{record, summary};
use super::strain::{self, Strains, write_maps};
use super::table::write_subjects;
use crate::error::CliError;
use crate::output::energy::write_energy;
use crate::output::names::{DISPLACEMENT, INPUT, VISIBILITY};
use crate::output::npy::Precision;
use crate::output::surface::PointArray;
use crate::output::vti::VtiFile;
use crate::output::{OutputError, ResultDir, numbered};
use crate::session::Session;
use crate::shapes::{ResultPlace, WorldFrame, records_of};
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
    let inputs = &records_of(&outcome.inputs);
    let place = ResultPlace::of_inputs(inputs);
    place.write(directory, "average", &outline)?;
    let grid = *outcome.result.average.grid();
    write_shape(directory, "average", inputs, &outline, grid)?;
    write_surfaces_of_inputs(directory, outcome, &place)?;
    write_components(directory, (outcome, inputs), &place, &outline, &parts)?;
    let space = Space::of_inputs(directory, inputs);
    let of_input = |number| Space::of_input(inputs, number);
    let determinants = strains.maps.iter().map(|maps| &*maps.determinant);
    let jacobians = write_warps(
        directory,
        space.as_ref(),
        of_input,
        displacements,
        determinants,
    )?;
    write_paraview(
        directory,
        outcome,
        WorldFrame::of_inputs(inputs),
        &jacobians,
    )?;
    let volume = enclosed_volume(&outline)?;
    let sizes = (volume, records(outcome, &parts)?);
    let strains = strains.ranges();
    write_subjects(directory, outcome, inputs, &strains)?;
    let record = record(outcome, sizes, place.record(), strains, session.start);
    record.write(directory)?;
    Ok(summary(&record, session.output))
}

/// Writes the surfaces of the inputs in 3D where they were aligned, each with the way of its points onto the average.
fn write_surfaces_of_inputs<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
    place: &ResultPlace<D>,
) -> Result<(), CliError> {
    if D == 2 || !directory.has_files() {
        return Ok(());
    }
    let pairs = outcome.inputs.iter().zip(&outcome.result.displacements);
    directory.for_each(pairs.enumerate(), &|(number, (input, displacement))| {
        let there = place.placed(&input.contour.displaced(displacement, 1.0));
        let here = place.placed(&input.contour);
        let ends = there.points().iter().zip(here.points());
        let ways: Vec<f64> = ends
            .flat_map(|(to, from)| (0..D).map(|k| to[k] - from[k]).collect::<Vec<f64>>())
            .collect();
        let array = PointArray {
            name: DISPLACEMENT,
            components: D,
            values: &ways,
        };
        let name = numbered(INPUT, number, "vtp");
        Ok(place.write_with(directory, &name, &input.contour, &[array])?)
    })
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
    Ok(contour(indicator, 0.5, BoxEdge::Closed)?)
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
    let seen = shapes.seen().iter().enumerate();
    directory.for_each(seen, &|(i, seen)| {
        directory.array(numbered(VISIBILITY, i, "npy"), seen)
    })?;
    let stiffness = outcome.config.params.void_stiffness;
    directory.for_each(shapes.indicators.iter().enumerate(), &|(i, indicator)| {
        let mut weight = indicator.clone();
        for x in weight.as_mut_slice() {
            *x = (1.0 - stiffness) * *x + stiffness;
        }
        Ok(directory.array(numbered("weight", i, "npy"), &weight)?)
    })
}

/// Everything at the nodes, for ParaView.
fn write_paraview<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
    world: Option<WorldFrame<D>>,
    jacobians: &[Field<f32, D, 1>],
) -> Result<(), CliError> {
    let result = &outcome.result;
    let labels = (!labels_of(outcome).is_empty()).then(|| label_field(outcome));
    Ok(directory.with_file("average.vti", |path| {
        let mut file = VtiFile::new(*result.average.grid(), Precision::Single)
            .within(world)
            .field("average", &result.average)
            .field("mask", &result.average_mask);
        if let Some(labels) = &labels {
            file = file.field("labels", labels);
        }
        file.fields("displacement", &result.displacements)
            .fields("jacobian", jacobians)
            .write(path)
    })?)
}
