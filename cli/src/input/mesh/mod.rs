//! Surfaces of triangles as inputs: STL, PLY, OBJ, and VTK files of both kinds.
//!
//! Coordinates are millimetres in the world (RAS), as the program writes them, unless the header of a
//! file states `SPACE=LPS`: then x and y are reversed. No format but VTP has a place for that; the
//! others state it in a header or a remark, as 3D Slicer does.

mod mend;
mod obj;
mod ply;
mod polygon;
mod stl;
mod text;
mod vtk;
mod vtp;

use std::path::Path;

use levelset::Contour;

use super::outline::{Fill, into_image};
use super::{AnyImage, InputError, bytes_of, extension_of};
pub(super) use mend::Fault;
use polygon::Polygons;

/// No surface may have more triangles than this.
pub const MAX_TRIANGLES: usize = 1 << 24;

/// The statement that coordinates are to the left and to the back.
const LEFT: &[u8] = b"SPACE=LPS";

/// Triangles of a file, in the world, as they stand there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mesh {
    pub points: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

/// Whether files with this extension, in small letters, hold surfaces.
pub(crate) fn is_mesh(extension: &str) -> bool {
    matches!(extension, "stl" | "ply" | "obj" | "vtk" | "vtp")
}

/// Reads the triangles of a file.
///
/// # Errors
/// [`InputError`] names the file, the defect and the remedy.
pub(crate) fn read_mesh(path: &Path) -> Result<Mesh, InputError> {
    decode(&bytes_of(path)?, path, &extension_of(path))
}

/// Reads a closed surface as a mask with an exact boundary.
pub(super) fn decode_image(
    bytes: &[u8],
    path: &Path,
    extension: &str,
) -> Result<AnyImage, InputError> {
    let mesh = decode(bytes, path, extension)?;
    let fault = |fault: Fault| fault.of_file(path);
    let mended = mend::mended(mesh).map_err(fault)?;
    let malformed = |error: levelset::LevelsetError| InputError::Malformed {
        path: path.into(),
        format: "surface",
        reason: error.to_string(),
    };
    let contour = Contour::new(mended.points, mended.triangles).map_err(malformed)?;
    let mut image = into_image(&contour, Fill::NonZero, path)?;
    let h = image.spacing[0];
    let row = |k: usize| {
        let mut row = [0.0, 0.0, 0.0, image.origin[k]];
        row[k] = h;
        row
    };
    image.affine = Some([row(0), row(1), row(2)]);
    image.remark = mended.remark;
    Ok(AnyImage::D3(image))
}

fn decode(bytes: &[u8], path: &Path, extension: &str) -> Result<Mesh, InputError> {
    let (format, read) = match extension {
        "stl" => ("STL", stl::decode(bytes)),
        "ply" => ("PLY", ply::decode(bytes)),
        "obj" => ("OBJ", obj::decode(bytes)),
        "vtk" => ("VTK", vtk::decode(bytes)),
        _ => ("VTP", vtp::decode(bytes)),
    };
    let malformed = |reason| InputError::Malformed {
        path: path.into(),
        format,
        reason,
    };
    let (polygons, to_the_left) = read.map_err(malformed)?;
    let mut mesh = polygons.triangulated().map_err(malformed)?;
    if mesh.triangles.len() > MAX_TRIANGLES {
        return Err(InputError::TooManyTriangles {
            path: path.into(),
            found: mesh.triangles.len(),
        });
    }
    if to_the_left {
        for point in &mut mesh.points {
            *point = [-point[0], -point[1], point[2]];
        }
    }
    Ok(mesh)
}

/// Whether a header states that coordinates are to the left and to the back.
fn states_left(header: &[u8]) -> bool {
    header.windows(LEFT.len()).any(|window| window == LEFT)
}

/// What a reader returns: polygons, and whether their coordinates are to the left and to the back.
type Decoded = Result<(Polygons, bool), String>;
