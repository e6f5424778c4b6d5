//! The files of a result directory.

use std::path::Path;

use levelset::Contour;
use nalgebra::{SMatrix, SVector};

use super::args::SegmentConfig;
use super::compute::Found;
use super::draw;
use super::record::{record, summary};
use crate::error::CliError;
use crate::output::energy::{EnergyPoint, energy_points, write_energy_plot, write_energy_table};
use crate::output::nifti::{Values, write_volume};
use crate::output::npy::Precision;
use crate::output::outline::write_outline;
use crate::output::surface::write_surface;
use crate::output::vti::VtiFile;
use crate::output::{OutputError, ResultDir, numbered};
use crate::session::Session;
use crate::summary::Summary;
use shapespace_input::Image;
use shapespace_input::lattice::Lattice;
use shapespace_picture::Shape;

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
    directory.picture("segment.png", || draw::picture(found))?;
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
        let mask = &found.placed.files.mask;
        let size = &found.placed.image.size;
        directory.mask(format!("{mask}.npy"), &object.mask, size)?;
        write_boundary(directory, found, &object.outline)?;
        directory.with_file(format!("{mask}.nii.gz"), |path| {
            write_volume_mask(path, &found.placed.image, &object.mask)
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

/// The boundary: closed curves in samples of the image, or a surface in the world of a volume, in
/// lengths of its file where it has none.
fn write_boundary<const D: usize>(
    directory: &ResultDir,
    found: &Found<D>,
    outline: &Contour<D>,
) -> Result<(), OutputError> {
    let name = &found.placed.files.boundary;
    let samples = outline.map(|p| found.placed.input.frame.to_sample(p));
    if D == 2 {
        return directory.with_file(format!("{name}.csv"), |path| {
            write_outline(path, &Shape::of(&samples).closed_curves())
        });
    }
    let image = &found.placed.image;
    let affine = image.affine;
    let matrix = SMatrix::<f64, D, D>::from_fn(|i, j| match affine {
        Some(affine) => affine[i][j],
        None => image.spacing[i] * f64::from(u8::from(i == j)),
    });
    let shift = SVector::<f64, D>::from_fn(|i, _| affine.map_or(0.0, |affine| affine[i][3]));
    let placed = samples.transformed(&matrix, &shift);
    directory.with_file(format!("{name}.stl"), |path| {
        write_surface(path, Shape::of(&placed).surface(), &[], affine.is_some())
    })
}

/// The mask of an object at the samples of a volume with a place in the world.
fn write_volume_mask<const D: usize>(
    path: &Path,
    image: &Image<D>,
    mask: &[bool],
) -> Result<(), OutputError> {
    let size: Option<[usize; 3]> = image.size.as_slice().try_into().ok();
    let Some((size, affine)) = size.zip(image.affine) else {
        return Ok(());
    };
    let bytes: Vec<u8> = mask.iter().map(|&inside| u8::from(inside)).collect();
    write_volume(path, &Lattice { size, affine }, &Values::Mask(&bytes))
}
