//! The files of a result directory.

use std::path::Path;

use levelset::Contour;

use super::args::SegmentConfig;
use super::compute::Found;
use super::draw;
use super::record::{record, summary};
use crate::error::CliError;
use crate::output::energy::{EnergyPoint, energy_points, write_energy_plot, write_energy_table};
use crate::output::npy::Precision;
use crate::output::vti::VtiFile;
use crate::output::{OutputError, ResultDir, numbered, write_text};
use crate::session::Session;
use crate::summary::Summary;

/// Names of the terms of the energy.
const PARTS: [&str; 3] = ["fidelity", "smoothness", "edges"];

/// Writes everything, `result.json` last.
///
/// # Errors
/// [`CliError`]; the directory is incomplete then.
pub(super) fn write_all<const D: usize>(
    directory: &ResultDir,
    config: &SegmentConfig,
    found: &[Found<D>],
    session: &Session<'_>,
) -> Result<Summary, CliError> {
    for (i, image) in found.iter().enumerate() {
        write_image(directory, i, image)?;
    }
    let points: Vec<EnergyPoint> = found.iter().flat_map(points).collect();
    directory.with_file("energy.csv", |path| {
        write_energy_table(path, &points, &PARTS)
    })?;
    let first = found.first().map(self::points).unwrap_or_default();
    directory.with_file("energy.svg", |path| write_energy_plot(path, &first, &PARTS))?;
    directory.with_file("segment.png", |path| draw::picture(found).write_png(path))?;
    let record = record(config, found, session.start);
    record.write(directory)?;
    Ok(summary(&record))
}

/// The convergence history of one image.
fn points<const D: usize>(found: &Found<D>) -> Vec<EnergyPoint> {
    energy_points(&found.history, |level| {
        let energy = found.result.levels.get(level)?.energy;
        Some(vec![energy.fidelity, energy.smoothness, energy.edges])
    })
}

fn write_image<const D: usize>(
    directory: &ResultDir,
    i: usize,
    found: &Found<D>,
) -> Result<(), CliError> {
    let result = &found.result;
    let grid = *result.image.grid();
    let name = |kind: &str| numbered(kind, i, "npy");
    directory.array(name("smoothed"), &result.image)?;
    directory.array(name("phasefield"), &result.phase_field)?;
    let edges = result.phase_field.as_slice().iter().map(|v| *v < 0.5);
    let edges: Vec<bool> = edges.collect();
    directory.mask(name("edges"), &edges, &grid.nodes_per_axis())?;
    if let Some(object) = &found.object {
        directory.mask(name("mask"), &object.mask, &found.placed.image.size)?;
        directory.with_file(numbered("outline", i, "csv"), |path| {
            write_outline(path, found, &object.outline)
        })?;
    }
    Ok(directory.with_file(numbered("segment", i, "vti"), |path| {
        let mut vti = VtiFile::new(grid, Precision::Single)
            .field("smoothed", &result.image)
            .field("phase_field", &result.phase_field);
        if let Some(object) = &found.object {
            vti = vti.field("object", &object.level_set);
        }
        vti.write(path)
    })?)
}

/// The boundary's simplices, one corner per line, in samples of the image: segments in 2D,
/// triangles in 3D.
fn write_outline<const D: usize>(
    path: &Path,
    found: &Found<D>,
    outline: &Contour<D>,
) -> Result<(), OutputError> {
    let axes = ["x", "y", "z"];
    let mut lines = vec![format!("piece,{}\n", axes[..D].join(","))];
    for (piece, corners) in outline.all_corners().enumerate() {
        for corner in corners {
            let sample = found.placed.input.frame.to_sample(corner);
            let numbers = sample.map(|x| format!("{x:.4}"));
            lines.push(format!("{piece},{}\n", numbers.join(",")));
        }
    }
    write_text(path, &lines.concat())
}
