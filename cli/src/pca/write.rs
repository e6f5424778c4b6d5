//! The files of the directory of an analysis.

use fe_grid::{VectorField, parallel};
use levelset::{BoxEdge, Contour, Moments, contour};

use super::command::Outcome;
use super::components::{displaced, outlines, phase_field_name};
use super::draw::{DrawnModes, animated, displacement, topology};
use super::images::ImageModes;
use super::map::ScoreMap;
use super::procrustes::Procrustes;
use super::record::{record, summary};
use super::report::write_report;
use super::tables::{write_quality, write_scores, write_scree};
use crate::error::CliError;
use crate::output::apng::write_animation;
use crate::output::names::MODE;
use crate::output::npy::Precision;
use crate::output::vti::VtiFile;
use crate::output::{ResultDir, numbered};
use crate::session::Session;
use crate::shapes::ResultPlace;
use crate::summary::Summary;
use shapespace_picture::Canvas;

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
    if outcome.continuation.as_ref().is_some_and(|c| c.continued) {
        let stored = &outcome.stored;
        directory.deformations("deformation", 0, stored.average.displacements())?;
        directory.array("average.npy", &stored.phase_field)?;
        for (c, component) in stored.components.iter().enumerate() {
            directory.array(phase_field_name(c), &component.phase_field)?;
        }
    }
    let pca = &outcome.pca;
    let quality = &outcome.quality;
    directory.with_file("scores.csv", |path| {
        write_scores(
            path,
            &outcome.stored.names,
            &pca.training,
            &quality.left_out,
            outcome.labelled.as_ref(),
        )
    })?;
    directory.with_file("scree.svg", |path| {
        write_scree(path, &pca.ratios(), &quality.compactness)
    })?;
    directory.with_file("quality.svg", |path| {
        write_quality(path, &directory.file("quality.csv"), quality)
    })?;
    let (size, crossing, fits) = if let Some(image) = &outcome.stored.image {
        let modes = ImageModes {
            image,
            space: &pca.space,
            amplitude: outcome.config.amplitude,
        };
        directory.picture("modes.png", || modes.strip())?;
        write_animations(directory, pca.modes.rank(), |j| modes.animation(j))?;
        // The whole box, without a boundary for comparison.
        let size = image.grid().extent().iter().product();
        (size, Vec::new(), Vec::new())
    } else {
        let object = outcome.stored.average.object();
        let outline = &contour(object, 0.5, BoxEdge::Closed)?;
        let components = &outlines(&outcome.stored.components)?;
        let modes = DrawnModes {
            average: outline,
            components,
            space: &pca.space,
            amplitude: outcome.config.amplitude,
        };
        directory.picture("modes.png", || modes.strip())?;
        write_animations(directory, pca.modes.rank(), |j| modes.animation(j))?;
        let crossing = write_boundaries(directory, &outcome.stored.place, &modes)?;
        write_map(directory, outcome, outline)?;
        let size = Moments::of_contour(outline)?.volume;
        (size, crossing, fits(outcome)?)
    };
    let record = record(outcome, (size, crossing), &fits, session.start);
    directory.with_file("report.md", |path| write_report(path, &record))?;
    record.write(directory)?;
    Ok(summary(&record))
}

/// The boundaries of the mean and, for every mode, of the shapes with the largest drawn score on both sides of it;
/// returns the names of those in pictures that have other parts, holes or tunnels than the mean.
fn write_boundaries<const D: usize>(
    directory: &ResultDir,
    place: &ResultPlace<D>,
    modes: &DrawnModes<'_, D>,
) -> Result<Vec<String>, CliError> {
    if !directory.has_files() {
        return Ok(Vec::new());
    }
    let grid = *modes.space.object.grid();
    let write = |name: &str, u: &VectorField<f64, D>| -> Result<Contour<D>, CliError> {
        let whole = modes.average.displaced(u, -1.0);
        place.write(directory, name, &whole)?;
        let parts = displaced(modes.components, u, -1.0);
        for ((label, _), (part, _)) in modes.components.iter().zip(parts) {
            place.write(directory, &format!("{name}_label_{label}"), &part)?;
        }
        Ok(whole)
    };
    let mean = modes.space.from_average(VectorField::zeros(grid));
    let mean = topology(&write("mean", &mean)?, grid)?;
    let pictured = animated(modes.space.fields.len());
    let ends = (0..modes.space.fields.len()).flat_map(|j| [(j, "minus", -1.0), (j, "plus", 1.0)]);
    let crossing = parallel::try_map(ends, &|(j, end, sign)| {
        let u = displacement(modes.space, j, sign * modes.amplitude);
        let shape = write(&format!("{MODE}{j:03}_{end}"), &u)?;
        let name = format!("mode {j} at {:+} s.d.", sign * modes.amplitude);
        // Of the modes in `modes.png`.
        let crosses = j < pictured && topology(&shape, grid)?.differences(&mean) > 0;
        Ok::<_, CliError>(crosses.then_some(name))
    });
    Ok(crossing?.into_iter().flatten().collect())
}

/// The first modes in motion.
fn write_animations(
    directory: &ResultDir,
    modes: usize,
    frames: impl Fn(usize) -> Vec<Canvas>,
) -> Result<(), CliError> {
    for j in 0..animated(modes) {
        directory.with_file(numbered("mode", j, "apng"), |path| {
            write_animation(path, &frames(j))
        })?;
    }
    Ok(())
}

/// Errors of the shapes reconstructed from their displacements.
fn fits<const D: usize>(outcome: &Outcome<D>) -> Result<Vec<Procrustes<D>>, CliError> {
    let average = &outcome.stored.average;
    let shapes = average.indicators().iter().zip(average.displacements());
    shapes
        .zip(&outcome.pca.displacements)
        .map(|((indicator, onto), u)| {
            let own = contour(indicator, 0.5, BoxEdge::Closed)?;
            let u = outcome.pca.space.from_average(u.clone());
            let back = own.displaced(onto, 1.0).displaced(&u, -1.0);
            Ok(Procrustes::new(back.points(), own.points()))
        })
        .collect()
}

fn write_arrays<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
) -> Result<(), CliError> {
    let (pca, space) = (&outcome.pca, &outcome.pca.space);
    directory.arrays("displacement", 0, &pca.displacements)?;
    directory.arrays("mode", 0, &space.fields)?;
    directory.array("mean_displacement.npy", &space.mean)?;
    directory.array("object.npy", &space.object)?;
    let gram = |i: usize, j: usize| Some(pca.gram[(i, j)]);
    directory.matrix("gram.npy", [pca.gram.nrows(); 2], gram)?;
    Ok(directory.with_file("modes.vti", |path| {
        VtiFile::new(*space.object.grid(), Precision::Single)
            .within(outcome.stored.world)
            .field("object", &space.object)
            .fields("mode", &space.fields)
            .write(path)
    })?)
}

/// The shapes at their scores, if there are two modes.
fn write_map<const D: usize>(
    directory: &ResultDir,
    outcome: &Outcome<D>,
    average: &Contour<D>,
) -> Result<(), CliError> {
    let pca = &outcome.pca;
    if pca.space.fields.len() < 2 || !directory.has_files() {
        return Ok(());
    }
    let scores: Vec<Vec<f64>> = pca.training.iter().map(|s| s.scores.clone()).collect();
    let alike = vec![0; scores.len()];
    let grouped = outcome.labelled.as_ref();
    let map = ScoreMap {
        average,
        space: &pca.space,
        scores: &scores,
        names: &outcome.stored.names,
        groups: grouped.map_or(&alike, |grouped| grouped.groups.labels()),
        group_names: grouped.map_or(&[], |grouped| &grouped.names),
        amplitude: outcome.config.amplitude,
    };
    match map.draw() {
        Some(map) => Ok(directory.picture("scores.png", || map)?),
        None => Ok(()),
    }
}
