//! Surfaces of triangles as inputs: STL, PLY, OBJ, and VTK files of both kinds.
//!
//! Coordinates are millimetres in the world (RAS), as the program writes them, unless the header of a
//! file states `SPACE=LPS`: then x and y are reversed. No format but VTP has a place for that; the
//! others state it in a header or a remark, as 3D Slicer does.

mod mend;
mod obj;
mod ply;
mod polygon;
mod seams;
mod stl;
mod text;
mod vtk;
mod vtp;

pub(super) use mend::{Fault, Mended, mended};
use polygon::Polygons;
pub(super) use seams::faces_inside;
pub(super) use vtp::point_array;

/// No surface may have more triangles than this.
pub const MAX_TRIANGLES: usize = 1 << 24;

/// The statement that coordinates are to the left and to the back.
const LEFT: &[u8] = b"SPACE=LPS";

/// Triangles of a file, in the world, as they stand there.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Its points.
    pub points: Vec<[f64; 3]>,
    /// The corners of its triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// Whether files with this extension, in small letters, hold surfaces.
pub fn is_mesh(extension: &str) -> bool {
    matches!(extension, "stl" | "ply" | "obj" | "vtk" | "vtp")
}

/// The triangles of a file with this extension, and the name of the format for a reason why there are
/// none.
pub(super) fn decode(bytes: &[u8], extension: &str) -> Result<Mesh, (&'static str, String)> {
    let (format, read) = match extension {
        "stl" => ("STL", stl::decode(bytes)),
        "ply" => ("PLY", ply::decode(bytes)),
        "obj" => ("OBJ", obj::decode(bytes)),
        "vtk" => ("VTK", vtk::decode(bytes)),
        _ => ("VTP", vtp::decode(bytes)),
    };
    let named = |reason| (format, reason);
    let (polygons, to_the_left) = read.map_err(named)?;
    let mut mesh = polygons.triangulated().map_err(named)?;
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
