//! Surfaces in the coordinates of the inputs.

use std::path::Path;

use levelset::Contour;
use nalgebra::{SMatrix, SVector};

use super::{Input, SurfaceRecord, WorldFrame, common_scale};
use crate::output::outline::write_outline;
use crate::output::{OutputError, ResultDir, surface};
use shapespace_picture::Shape;

/// Writes a boundary in 3D as a surface in the coordinates of the inputs, in files with these
/// extensions, and returns the coordinates.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn write_surface<const D: usize>(
    directory: &ResultDir,
    name: impl AsRef<Path>,
    extensions: &[&str],
    inputs: &[Input<D>],
    shape: &Contour<D>,
) -> Result<Option<SurfaceRecord>, OutputError> {
    if D == 2 {
        return Ok(None);
    }
    let (placed, record) = in_input_coordinates(inputs, shape);
    let in_world = record.coordinates == "world";
    for &extension in extensions {
        let name = name.as_ref().with_extension(extension);
        directory.with_file(name, |path| {
            surface::write_surface(path, Shape::of(&placed).surface(), in_world)
        })?;
    }
    Ok(Some(record))
}

/// Writes a boundary in 2D as closed curves in the coordinates of the inputs, and returns these.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn write_curves<const D: usize>(
    directory: &ResultDir,
    name: &str,
    inputs: &[Input<D>],
    shape: &Contour<D>,
) -> Result<Option<SurfaceRecord>, OutputError> {
    if D == 3 {
        return Ok(None);
    }
    let (placed, record) = in_input_coordinates(inputs, shape);
    directory.with_file(name, |path| {
        write_outline(path, &Shape::of(&placed).closed_curves())
    })?;
    Ok(Some(record))
}

/// A shape in the world of the results, or else in the position of the reference of the alignment, or
/// of the first input without one, in world coordinates if its file states them. Inputs of different scales have no common length
/// unit: then the shape stays in the unit box.
fn in_input_coordinates<const D: usize>(
    inputs: &[Input<D>],
    shape: &Contour<D>,
) -> (Contour<D>, SurfaceRecord) {
    if common_scale(inputs).is_none() {
        let record = SurfaceRecord {
            coordinates: "unit_box",
            of_input: None,
        };
        return (shape.clone(), record);
    }
    if let Some(world) = WorldFrame::of_inputs(inputs) {
        let record = SurfaceRecord {
            coordinates: "world",
            of_input: Some(world.number()),
        };
        return (shape.map(|p| world.position(p)), record);
    }
    let is_reference = |input: &Input<D>| input.alignment.is_some_and(|a| a.reference);
    let reference = inputs.iter().position(is_reference).unwrap_or(0);
    let input = &inputs[reference];
    let unit = |p: [f64; D]| input.alignment.map_or(p, |a| a.motion.map_back(p));
    let (placed, coordinates) = if let Some(affine) = input.affine {
        let samples = shape.map(|p| input.frame.to_sample(unit(p)));
        let matrix = SMatrix::<f64, D, D>::from_fn(|i, j| affine[i][j]);
        let shift = SVector::<f64, D>::from_fn(|i, _| affine[i][3]);
        (samples.transformed(&matrix, &shift), "world")
    } else {
        (shape.map(|p| input.frame.to_physical(unit(p))), "input")
    };
    let record = SurfaceRecord {
        coordinates,
        of_input: Some(reference),
    };
    (placed, record)
}
