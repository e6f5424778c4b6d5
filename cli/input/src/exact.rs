//! Surfaces and outlines in files as masks with exact boundaries.

use std::path::Path;

use levelset::Contour;

use super::curves::{self, is_outline};
use super::filled::Filled;
use super::mesh::{self, Fault, MAX_TRIANGLES, Mended, Mesh, is_mesh};
use super::outline::{Source, into_image};
use super::resolve::{Resolved, resolved};
use super::winding::Fill;
use super::{AnyImage, Image, InputError, bytes_of, extension_of, reserve};

/// Bytes for each segment while curves are compared.
const SEGMENT: u64 = 400;
/// Bytes for each triangle while these are compared.
const TRIANGLE: u64 = 100;
/// Faces inside of an object count from the square of this share of its length on: the side of a face of a sample.
const SEAM: f64 = 1.0 / 128.0;

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
        return Ok(AnyImage::D2(outlined(&filled, path)?));
    }
    let mesh = triangles(bytes, path, extension)?;
    let Mended {
        points,
        triangles,
        remark,
    } = mesh::mended(mesh).map_err(|fault| unfit(fault, path))?;
    let contour = Contour::new(points, triangles)
        .map_err(|error| malformed(path)(("surface", error.to_string())))?;
    let (source, seams) = source_of(&contour, path)?;
    let mut image = into_image(&Filled::of_one(contour, Fill::NonZero), source, path)?;
    let h = image.spacing[0];
    let row = |k: usize| {
        let mut row = [0.0, 0.0, 0.0, image.origin[k]];
        row[k] = h;
        row
    };
    image.affine = Some([row(0), row(1), row(2)]);
    let remarks: Vec<String> = remark.into_iter().chain(seams).collect();
    image.remark = (!remarks.is_empty()).then(|| remarks.join(", "));
    Ok(AnyImage::D3(image))
}

/// Where the boundary of what a closed surface encloses is taken from, with a remark where it is not the surface.
fn source_of(contour: &Contour<3>, path: &Path) -> Result<(Source, Option<String>), InputError> {
    reserve(path, TRIANGLE * contour.simplices().len() as u64, 0)?;
    let [low, high] = contour.bounds();
    let longest = (0..3).fold(0.0, |m: f64, k| m.max(high[k] - low[k]));
    let found = mesh::faces_inside(contour.points(), contour.simplices());
    let area = found.common.max(found.crossed);
    if area <= (SEAM * longest).powi(2) {
        return Ok((Source::Contours, None));
    }
    let remark = format!(
        "faces of {area:.3} square units lie inside, where parts touch or overlap, and are left out: the boundary \
         is that of samples {:.3} apart; unite the parts in a modelling program for the exact one",
        SEAM * longest
    );
    Ok((Source::Samples, Some(remark)))
}

/// What closed curves enclose, as a mask.
fn outlined(filled: &Filled<2>, path: &Path) -> Result<Image<2>, InputError> {
    reserve(path, SEGMENT * filled.whole().simplices().len() as u64, 0)?;
    match resolved(filled) {
        Resolved::Apart => into_image(filled, Source::Contours, path),
        Resolved::Boundary(contour) if contour.is_empty() => {
            Err(malformed(path)(("outline", "it encloses no area".into())))
        }
        Resolved::Boundary(contour) => {
            let object = Filled::of_one(contour, Fill::NonZero);
            into_image(&object, Source::Contours, path)
        }
        Resolved::Unknown => into_image(filled, Source::Samples, path),
    }
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
