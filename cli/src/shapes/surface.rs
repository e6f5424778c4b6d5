//! Surfaces in the coordinates of the inputs.

use std::path::Path;

use levelset::Contour;

use super::{Coordinates, Input, InputRecord, SurfaceRecord};
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

/// A shape in the coordinates of the results ([`Coordinates::of_result`]); in the unit box where there are none.
fn in_input_coordinates<const D: usize>(
    inputs: &[Input<D>],
    shape: &Contour<D>,
) -> (Contour<D>, SurfaceRecord) {
    let records: Vec<_> = inputs.iter().map(InputRecord::new).collect();
    let found = Coordinates::of_result(&records);
    let Some((coordinates, number)) = found.filter(|(coordinates, _)| !coordinates.is_box()) else {
        let record = SurfaceRecord {
            coordinates: "unit_box",
            of_input: None,
        };
        return (shape.clone(), record);
    };
    let record = SurfaceRecord {
        coordinates: if records[number].states_place() {
            "world"
        } else {
            "input"
        },
        of_input: Some(number),
    };
    (coordinates.placed(shape), record)
}
