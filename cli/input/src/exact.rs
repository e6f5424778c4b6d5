//! Surfaces and outlines in files as masks with exact boundaries.

use std::path::Path;

use levelset::Contour;

use super::curves::{self, is_outline};
use super::filled::Filled;
use super::mesh::{self, Fault, MAX_TRIANGLES, Mended, Mesh, is_mesh};
use super::outline::into_image;
use super::winding::Fill;
use super::{AnyImage, InputError, bytes_of, extension_of};

/// Whether files with this extension, in small letters, hold surfaces or outlines.
pub(crate) fn is_exact(extension: &str) -> bool {
    is_mesh(extension) || is_outline(extension)
}

/// Reads the triangles of a file, in the world.
///
/// # Errors
/// [`InputError`] names the file, the defect and the remedy.
pub fn read_mesh(path: &Path) -> Result<Mesh, InputError> {
    decode_mesh(&bytes_of(path)?, path)
}

/// Reads the numbers of an array at the points of a surface (`.vtp`), those of the first point first, as they
/// stand there: vectors of files with coordinates to the left and to the back are not reversed.
///
/// # Errors
/// As [`read_mesh`]; also for a file without such an array.
pub fn read_point_array(path: &Path, name: &str) -> Result<Vec<f64>, InputError> {
    let found = mesh::point_array(&bytes_of(path)?, name);
    found.map_err(|reason| malformed(path)(("VTP", reason)))
}

/// The triangles in the bytes of a file; the name determines the format.
///
/// # Errors
/// As [`read_mesh`].
pub fn decode_mesh(bytes: &[u8], path: &Path) -> Result<Mesh, InputError> {
    triangles(bytes, path, &extension_of(path))
}

/// Reads the closed curves of a file, as they are: a table or a drawing.
///
/// # Errors
/// As [`read_mesh`].
pub fn read_outline(path: &Path) -> Result<Filled<2>, InputError> {
    decode_outline(&bytes_of(path)?, path)
}

/// The closed curves in the bytes of a file; the name determines the format.
///
/// # Errors
/// As [`read_mesh`].
pub fn decode_outline(bytes: &[u8], path: &Path) -> Result<Filled<2>, InputError> {
    curves::decode(bytes, &extension_of(path)).map_err(malformed(path))
}

/// Reads a surface or an outline as a mask.
pub(crate) fn decode_image(
    bytes: &[u8],
    path: &Path,
    extension: &str,
) -> Result<AnyImage, InputError> {
    if is_outline(extension) {
        let filled = curves::decode(bytes, extension).map_err(malformed(path))?;
        return Ok(AnyImage::D2(into_image(&filled, path)?));
    }
    let mesh = triangles(bytes, path, extension)?;
    let Mended {
        points,
        triangles,
        remark,
    } = mesh::mended(mesh).map_err(|fault| unfit(fault, path))?;
    let contour = Contour::new(points, triangles)
        .map_err(|error| malformed(path)(("surface", error.to_string())))?;
    let mut image = into_image(&Filled::of_one(contour, Fill::NonZero), path)?;
    let h = image.spacing[0];
    let row = |k: usize| {
        let mut row = [0.0, 0.0, 0.0, image.origin[k]];
        row[k] = h;
        row
    };
    image.affine = Some([row(0), row(1), row(2)]);
    image.remark = remark;
    Ok(AnyImage::D3(image))
}

fn triangles(bytes: &[u8], path: &Path, extension: &str) -> Result<Mesh, InputError> {
    let mesh = mesh::decode(bytes, extension).map_err(malformed(path))?;
    let found = mesh.triangles.len();
    if found > MAX_TRIANGLES {
        let path = path.into();
        return Err(InputError::TooManyTriangles { path, found });
    }
    Ok(mesh)
}

fn malformed(path: &Path) -> impl Fn((&'static str, String)) -> InputError + '_ {
    |(format, reason)| InputError::Malformed {
        path: path.into(),
        format,
        reason,
    }
}

fn unfit(fault: Fault, path: &Path) -> InputError {
    let path = path.into();
    match fault {
        Fault::Open {
            open,
            holes,
            crowded,
            widest,
            limit,
        } => InputError::OpenSurface {
            path,
            open,
            holes,
            crowded,
            widest,
            limit,
        },
        Fault::Flat => InputError::FlatSurface { path },
    }
}
