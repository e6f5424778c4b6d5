//! Surfaces as binary STL.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use super::OutputError;
use crate::picture::Surface;

/// How the header states that coordinates are those of the world (RAS), for readers that expect
/// others where nothing is stated.
const WORLD: &[u8] = b"SPACE=RAS";

/// States in the header of a surface that has been written that it lies in the world.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn state_world(path: &Path) -> Result<(), OutputError> {
    let mut file = File::options()
        .write(true)
        .open(path)
        .map_err(OutputError::at(path))?;
    file.write_all(WORLD).map_err(OutputError::at(path))
}

/// Writes a surface of triangles, corners counterclockwise as seen from outside.
///
/// # Errors
/// [`OutputError::Unwritable`], also where a triangle names a vertex that does not exist.
pub fn write_surface(path: &Path, surface: Surface<'_>) -> Result<(), OutputError> {
    let mut file = File::create(path).map_err(OutputError::at(path))?;
    surface_to(&mut file, surface).map_err(OutputError::at(path))
}

/// The same into any writer.
///
/// # Errors
/// Those of the writer, and [`io::ErrorKind::InvalidData`] for an index out of range.
pub fn surface_to(writer: &mut impl Write, surface: Surface<'_>) -> io::Result<()> {
    let facets = surface
        .triangles
        .iter()
        .map(|&triangle| facet(surface.vertices, triangle))
        .collect::<io::Result<Vec<_>>>()?;
    stl_io::write_stl(writer, facets.iter())
}

fn facet(vertices: &[[f64; 3]], triangle: [usize; 3]) -> io::Result<stl_io::Triangle> {
    let mut corners = [[0.0; 3]; 3];
    for (corner, index) in corners.iter_mut().zip(triangle) {
        *corner = *vertices.get(index).ok_or_else(|| {
            io::Error::new(
                io::ErrorKind::InvalidData,
                format!("a triangle names vertex {index} of {}", vertices.len()),
            )
        })?;
    }
    let [a, b, c] = corners;
    let u: [f64; 3] = std::array::from_fn(|k| b[k] - a[k]);
    let v: [f64; 3] = std::array::from_fn(|k| c[k] - a[k]);
    let normal: [f64; 3] =
        std::array::from_fn(|k| u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]);
    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    // STL readers take a zero normal as one to be computed from the corners.
    let unit = normal.map(|x| {
        if length > 0.0 {
            (x / length) as f32
        } else {
            0.0
        }
    });
    Ok(stl_io::Triangle {
        normal: stl_io::Normal::new(unit),
        vertices: corners.map(|corner| stl_io::Vertex::new(corner.map(|x| x as f32))),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn a_tetrahedron_comes_back_closed_with_outward_normals() {
        let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mut bytes = Vec::new();
        let surface = |triangles| Surface {
            vertices: &vertices,
            triangles,
        };
        surface_to(&mut bytes, surface(&triangles)).unwrap();
        let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).unwrap();
        assert_eq!(mesh.vertices.len(), 4);
        mesh.validate().unwrap();
        for face in &mesh.faces {
            let centre: [f32; 3] = std::array::from_fn(|k| {
                face.vertices
                    .iter()
                    .map(|&v| mesh.vertices[v].0[k])
                    .sum::<f32>()
                    / 3.0
                    - 0.25
            });
            let outward: f32 = (0..3).map(|k| centre[k] * face.normal.0[k]).sum();
            assert!(outward > 0.0);
        }
        assert!(surface_to(&mut Vec::new(), surface(&[[0, 1, 4]])).is_err());
    }
}
