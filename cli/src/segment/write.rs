//! The files of a result directory.

use std::fmt::Write as _;
use std::time::Instant;

use levelset::Contour;

use super::args::SegmentConfig;
use super::compute::Found;
use super::draw;
use super::record::{Record, record};
use crate::error::CliError;
use crate::output::energy::{EnergyPoint, write_energy_plot, write_energy_table};
use crate::output::npy::{Precision, write_field, write_mask};
use crate::output::vti::VtiFile;
use crate::output::{OutputError, ResultDir, numbered};
use crate::watch::is_last;

/// Names of the terms of the energy.
const PARTS: [&str; 3] = ["fidelity", "smoothness", "edges"];

/// Writes everything, `result.json` last, and returns what is in it.
///
/// # Errors
/// [`CliError`]; the directory is incomplete then.
pub(super) fn write_all<'a, const D: usize>(
    directory: &ResultDir,
    config: &SegmentConfig,
    found: &'a [Found<D>],
    start: Instant,
) -> Result<Record<'a, D>, CliError> {
    for (i, image) in found.iter().enumerate() {
        write_image(directory, i, image)?;
    }
    let points: Vec<EnergyPoint> = found.iter().flat_map(energy_points).collect();
    write_energy_table(&directory.file("energy.csv"), &points, &PARTS)?;
    let first = found.first().map(energy_points).unwrap_or_default();
    write_energy_plot(&directory.file("energy.svg"), &first, &PARTS)?;
    draw::picture(found).write_png(&directory.file("segment.png"))?;
    let record = record(config, found, start);
    record.write(directory.path())?;
    Ok(record)
}

fn write_image<const D: usize>(
    directory: &ResultDir,
    i: usize,
    found: &Found<D>,
) -> Result<(), CliError> {
    let result = &found.result;
    let grid = *result.image.grid();
    let file = |kind: &str, ending: &str| directory.file(numbered(kind, i, ending));
    write_field(&file("smoothed", "npy"), &result.image, Precision::Double)?;
    write_field(
        &file("phasefield", "npy"),
        &result.phase_field,
        Precision::Double,
    )?;
    let edges: Vec<bool> = result
        .phase_field
        .as_slice()
        .iter()
        .map(|v| *v < 0.5)
        .collect();
    write_mask(&file("edges", "npy"), &edges, &grid.nodes_per_axis())?;
    let mut vti = VtiFile::new(grid, Precision::Single)
        .field("smoothed", &result.image)
        .field("phase_field", &result.phase_field);
    if let Some(object) = &found.object {
        write_mask(&file("mask", "npy"), &object.mask, &found.placed.image.size)?;
        write_outline(&file("outline", "csv"), found, &object.outline)?;
        vti = vti.field("object", &object.level_set);
    }
    vti.write(&file("segment", "vti"))?;
    Ok(())
}

/// The boundary's simplices, a corner a line, in samples of the image: segments in 2D, triangles
/// in 3D.
fn write_outline<const D: usize>(
    path: &std::path::Path,
    found: &Found<D>,
    outline: &Contour<D>,
) -> Result<(), OutputError> {
    let axes = ["x", "y", "z"];
    let mut text = format!("piece,{}\n", axes[..D].join(","));
    for (piece, corners) in outline.all_corners().enumerate() {
        for corner in corners {
            let sample = found.placed.frame.to_sample(corner);
            let numbers: Vec<String> = sample.iter().map(|x| format!("{x:.4}")).collect();
            // Writing into a string cannot fail.
            let _ = writeln!(text, "{piece},{}", numbers.join(","));
        }
    }
    std::fs::write(path, text).map_err(OutputError::at(path))
}

/// The convergence history of one image; the terms of the energy are known at the end of each
/// level.
fn energy_points<const D: usize>(found: &Found<D>) -> Vec<EnergyPoint> {
    let history = &found.history;
    let points = history.iter().enumerate().map(|(i, point)| EnergyPoint {
        level: point.level,
        nodes: point.nodes,
        iteration: point.iteration,
        evaluations: point.evaluations,
        total: point.energy,
        parts: is_last(history, i)
            .then(|| found.result.levels.get(point.level))
            .flatten()
            .map(|level| {
                let energy = level.energy;
                vec![energy.fidelity, energy.smoothness, energy.edges]
            }),
    });
    points.collect()
}
