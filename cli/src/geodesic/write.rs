//! The files of a result directory.

use ::geodesic::{Form, GeodesicParams};
use fe_grid::{Field, ScalarField};

use super::Outcome;
use super::draw::{Draw, Pictures};
use super::path::Path;
use super::record::{Record, record};
use crate::error::CliError;
use crate::output::apng::write_animation;
use crate::output::energy::{EnergyPoint, write_energy_plot, write_energy_table};
use crate::output::npy::{Precision, write_field};
use crate::output::pvd::write_series;
use crate::output::steps::{StepTable, write_steps_plot, write_steps_table};
use crate::output::vti::VtiFile;
use crate::output::{ResultDir, deformation, numbered};
use crate::shapes::{Input, SurfaceRecord};
use crate::watch::is_last;

/// Names of the parts of the energy; level sets alone have the last.
const PARTS: [&str; 3] = ["dissipation", "mismatch", "area"];

/// Writes everything, `result.json` last, and returns what is in it.
///
/// # Errors
/// [`CliError`]; the directory is incomplete then.
pub(super) fn write_all<'a, const D: usize>(
    directory: &ResultDir,
    outcome: &'a Outcome<D>,
) -> Result<Record<'a, D>, CliError>
where
    Pictures: Draw<D>,
{
    let path = Path::new(outcome)?;
    let surface = write_path(directory, &outcome.inputs, &path)?;
    write_motions(directory, &outcome.result.motions)?;
    write_components(directory, &outcome.result.components)?;
    write_energy(directory, outcome)?;
    let record = record(outcome, &path, surface);
    record.write(directory.path())?;
    Ok(record)
}

/// Writes the files of any path: shapes and steps as arrays, as series, as tables and in pictures,
/// and surfaces in 3D. Returns the coordinate system of the surfaces.
///
/// # Errors
/// [`CliError`]; the directory is incomplete then.
pub(crate) fn write_path<const D: usize>(
    directory: &ResultDir,
    inputs: &[Input<D>],
    path: &Path<D>,
) -> Result<Option<SurfaceRecord>, CliError>
where
    Pictures: Draw<D>,
{
    write_arrays(directory, path)?;
    write_paraview(directory, path)?;
    write_steps(directory, path)?;
    Pictures::film(path).write_png(&directory.file("geodesic.png"))?;
    let frames = Pictures::animation(path);
    write_animation(&directory.file("geodesic.apng"), &frames)?;
    Pictures::surfaces(directory, inputs, path)
}

/// Writes the deformations of the start shape into every other.
///
/// # Errors
/// [`CliError::Output`].
pub(crate) fn write_motions<const D: usize>(
    directory: &ResultDir,
    motions: &[Field<f64, D, D>],
) -> Result<(), CliError> {
    for (k, motion) in motions.iter().enumerate() {
        let path = directory.file(numbered("psi", k + 1, "npy"));
        write_field(&path, &deformation(motion), Precision::Double)?;
    }
    Ok(())
}

/// Writes the level sets of the components of all shapes, where there are several.
fn write_components<const D: usize>(
    directory: &ResultDir,
    shapes: &[Vec<ScalarField<f64, D>>],
) -> Result<(), CliError> {
    for (k, components) in shapes.iter().enumerate() {
        for (i, level_set) in components.iter().enumerate() {
            let name = format!("shape_{k:03}_component_{i}.npy");
            write_field(&directory.file(name), level_set, Precision::Double)?;
        }
    }
    Ok(())
}

fn write_arrays<const D: usize>(directory: &ResultDir, path: &Path<D>) -> Result<(), CliError> {
    for (k, level_set) in path.level_sets.iter().enumerate() {
        let file = directory.file(numbered("shape", k, "npy"));
        write_field(&file, level_set, Precision::Double)?;
    }
    for (k, displacement) in path.displacements[..path.steps()].iter().enumerate() {
        let file = directory.file(numbered("deformation", k + 1, "npy"));
        write_field(&file, &deformation(displacement), Precision::Double)?;
    }
    Ok(())
}

/// One file for every shape, with the step that deforms it into the next; the last shape has
/// zeros there, since all files of a series hold the same fields.
fn write_paraview<const D: usize>(directory: &ResultDir, path: &Path<D>) -> Result<(), CliError> {
    let mut series = Vec::new();
    for (k, level_set) in path.level_sets.iter().enumerate() {
        let none = fe_grid::ScalarField::zeros(*level_set.grid());
        let name = numbered("shape", k, "vti");
        VtiFile::new(*level_set.grid(), Precision::Single)
            .field("level_set", level_set)
            .field("displacement", &path.displacements[k])
            .field("dissipation", path.densities.get(k).unwrap_or(&none))
            .write(&directory.file(&name))?;
        series.push((k as f64 / path.steps().max(1) as f64, name));
    }
    Ok(write_series(&directory.file("geodesic.pvd"), &series)?)
}

fn write_energy<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
) -> Result<(), CliError> {
    let history = &outcome.history;
    let points: Vec<EnergyPoint> = history
        .iter()
        .enumerate()
        .map(|(i, point)| EnergyPoint {
            level: point.level,
            nodes: point.nodes,
            iteration: point.iteration,
            evaluations: point.evaluations,
            total: point.energy,
            parts: is_last(history, i)
                .then(|| parts(outcome, point.level))
                .flatten(),
        })
        .collect();
    let names = &PARTS[..if has_area(outcome) { 3 } else { 2 }];
    write_energy_table(&directory.file("energy.csv"), &points, names)?;
    write_energy_plot(&directory.file("energy.svg"), &points, names)?;
    Ok(())
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
        energies: &path.energies,
        sizes: &path.sizes,
        size: if D == 2 { "area" } else { "volume" },
    };
    write_steps_table(&directory.file("steps.csv"), &table)?;
    Ok(write_steps_plot(&directory.file("steps.svg"), &table)?)
}
