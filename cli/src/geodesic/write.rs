//! The files of a result directory.

use ::geodesic::{Form, GeodesicParams};
use fe_grid::{Field, ScalarField};

use super::Outcome;
use super::draw::{animation, film};
use super::path::Path;
use super::record::{record, summary};
use crate::error::CliError;
use crate::output::apng::write_animation;
use crate::output::energy::write_energy;
use crate::output::npy::Precision;
use crate::output::pvd::write_series;
use crate::output::steps::{StepTable, write_steps_plot, write_steps_table};
use crate::output::vti::VtiFile;
use crate::output::{ResultDir, numbered};
use crate::session::Session;
use crate::shapes::{BoundaryRecord, InputRecord, ResultPlace, WorldFrame, records_of};
use crate::summary::Summary;
use crate::warp::{write_shape, write_steps_in_world};

/// The name of the pictures of a geodesic.
pub(crate) const STEM: &str = "geodesic";
/// Names of the parts of the energy; level sets alone have the last.
const PARTS: [&str; 3] = ["dissipation", "mismatch", "area"];

/// Writes everything, `result.json` last.
///
/// # Errors
/// [`CliError`]; the directory is incomplete then.
pub(super) fn write_all<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
    session: &Session<'_>,
) -> Result<Summary, CliError> {
    let path = Path::new(outcome)?;
    let coordinates = write_path(directory, STEM, &records_of(&outcome.inputs), &path)?;
    directory.deformations("psi", 1, &outcome.result.motions)?;
    directory.deformations("backward", 1, &outcome.result.backward_motions)?;
    if let Some(middle) = &outcome.result.middle {
        directory.array("middle_shape.npy", &middle.shape.union())?;
        directory.deformations("middle", 0, &middle.motions)?;
    }
    for (k, components) in outcome.result.components.iter().enumerate() {
        for (i, level_set) in components.iter().enumerate() {
            directory.array(format!("shape_{k:03}_component_{i}.npy"), level_set)?;
        }
    }
    let names = &PARTS[..if has_area(outcome) { 3 } else { 2 }];
    write_energy(directory, &outcome.history, names, |level| {
        parts(outcome, level)
    })?;
    let record = record(outcome, &path, coordinates, session.start);
    record.write(directory)?;
    Ok(summary(&record))
}

/// Writes the files of any path: shapes and steps as arrays, as series, as tables and in pictures,
/// and the boundaries in the coordinates of the inputs: outlines in 2D, surfaces in 3D. Where the inputs have a place in
/// the world, the shapes are written as volumes there, and the steps as displacement fields. Pictures and series have
/// the name `stem`. Returns the coordinate systems of the boundaries.
///
/// # Errors
/// [`CliError`]; the directory is incomplete then.
pub(crate) fn write_path<const D: usize>(
    directory: &ResultDir,
    stem: &str,
    inputs: &[InputRecord<D>],
    path: &Path<D>,
) -> Result<BoundaryRecord, CliError> {
    directory.arrays("shape", 0, &path.parts.level_sets)?;
    directory.deformations("deformation", 1, &path.parts.displacements)?;
    write_paraview(directory, stem, path, WorldFrame::of_inputs(inputs))?;
    write_steps(directory, path)?;
    directory.picture(format!("{stem}.png"), || film(path))?;
    directory.with_file(format!("{stem}.apng"), |file| {
        write_animation(file, &animation(path))
    })?;
    let place = ResultPlace::of_inputs(inputs);
    for (k, contour) in path.contours.iter().enumerate() {
        let name = format!("shape_{k:03}");
        place.write(directory, &name, contour)?;
        // A shape that has vanished has no distance.
        if !contour.points().is_empty() {
            let grid = *path.parts.level_sets[k].grid();
            write_shape(directory, &name, inputs, contour, grid)?;
        }
    }
    write_steps_in_world(directory, inputs, &path.parts.displacements)?;
    Ok(place.record())
}

/// One file for every shape, with the step that deforms it into the next; the last shape has
/// zeros there, since all files of a series hold the same fields.
fn write_paraview<const D: usize>(
    directory: &ResultDir,
    stem: &str,
    path: &Path<D>,
    world: Option<WorldFrame<D>>,
) -> Result<(), CliError> {
    let mut series = Vec::new();
    for (k, level_set) in path.parts.level_sets.iter().enumerate() {
        let none = ScalarField::zeros(*level_set.grid());
        let still = Field::zeros(*level_set.grid());
        let name = numbered("shape", k, "vti");
        directory.with_file(&name, |file| {
            VtiFile::new(*level_set.grid(), Precision::Single)
                .within(world)
                .field("level_set", level_set)
                .field(
                    "displacement",
                    path.parts.displacements.get(k).unwrap_or(&still),
                )
                .field("dissipation", path.densities.get(k).unwrap_or(&none))
                .write(file)
        })?;
        series.push((k as f64 / path.steps().max(1) as f64, name));
    }
    Ok(directory.with_file(format!("{stem}.pvd"), |file| write_series(file, &series))?)
}

fn has_area<const D: usize>(outcome: &Outcome<D>) -> bool {
    outcome.config.params.form == Form::LevelSets
}

/// The weighted terms of the energy at the end of a level.
fn parts<const D: usize>(outcome: &Outcome<D>, level: usize) -> Option<Vec<f64>> {
    let level = outcome.result.levels.get(level)?;
    let dissipation = level.energy.dissipation();
    if !has_area(outcome) {
        return Some(vec![dissipation, level.energy.total - dissipation]);
    }
    // Preliminary levels may have more steps, and with them another weight.
    let params = GeodesicParams {
        steps: level.steps,
        ..outcome.config.params.clone()
    };
    let mismatch = params.resolved_mismatch_weight() * level.energy.mismatches.iter().sum::<f64>();
    Some(vec![
        dissipation,
        mismatch,
        level.energy.total - dissipation - mismatch,
    ])
}

fn write_steps<const D: usize>(directory: &ResultDir, path: &Path<D>) -> Result<(), CliError> {
    let table = StepTable {
        energies: &path.parts.energies,
        sizes: &path.sizes,
        size: if D == 2 { "area" } else { "volume" },
    };
    directory.with_file("steps.csv", |file| write_steps_table(file, &table))?;
    Ok(directory.with_file("steps.svg", |file| write_steps_plot(file, &table))?)
}
