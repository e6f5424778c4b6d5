//! Surfaces of triangles as STL, PLY and VTP. Files whose coordinates are those of the world state
//! `SPACE=RAS` where 3D Slicer expects it, which would take them for LPS otherwise.

mod ply;
pub mod stl;
mod vtp;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::OutputError;
use shapespace_picture::Surface;

/// How a header states that coordinates are those of the world.
const WORLD: &str = "SPACE=RAS";

/// Numbers at the points of a surface, the components of the first point before those of the second.
#[derive(Clone, Copy, Debug)]
pub struct PointArray<'a> {
    /// Its name in the file.
    pub name: &'a str,
    /// Numbers of a point.
    pub components: usize,
    /// All numbers.
    pub values: &'a [f64],
}

/// Writes a surface of triangles, corners counterclockwise as seen from outside, in the format of
/// the extension: `.ply`, `.vtp`, and STL for any other. Only VTP files have arrays.
///
/// # Errors
/// [`OutputError::Unwritable`], also where a triangle names a vertex that does not exist, or an array has not
/// as many numbers as the points need.
pub fn write_surface(
    path: &Path,
    surface: Surface<'_>,
    arrays: &[PointArray<'_>],
    in_world: bool,
) -> Result<(), OutputError> {
    let extension = path.extension().unwrap_or_default();
    let write = |writer: &mut BufWriter<File>| {
        if extension == "ply" {
            ply::surface_to(writer, surface, in_world)
        } else if extension == "vtp" {
            vtp::surface_to(writer, surface, arrays, in_world)
        } else {
            stl::surface_to(writer, surface, in_world)
        }?;
        writer.flush()
    };
    let file = File::create(path);
    let written = file.and_then(|file| write(&mut BufWriter::new(file)));
    written.map_err(OutputError::at(path))
}

/// The number of a vertex, in the form of the formats.
fn corner(surface: &Surface<'_>, index: usize) -> io::Result<i32> {
    let count = surface.vertices.len();
    let number = i32::try_from(index).ok().filter(|_| index < count);
    number.ok_or_else(|| {
        let message = format!("a triangle names vertex {index} of {count}");
        io::Error::new(io::ErrorKind::InvalidData, message)
    })
}
