//! Surfaces as binary STL.

use std::io::{self, Write};

use super::{WORLD, corner};
use shapespace_picture::Surface;

/// Length of the header.
const HEADER: usize = 80;

/// Writes a surface; points in single precision.
///
/// # Errors
/// Those of the writer, and [`io::ErrorKind::InvalidData`] for an index out of range.
pub fn surface_to(writer: &mut impl Write, surface: Surface<'_>, in_world: bool) -> io::Result<()> {
    let facets = surface
        .triangles
        .iter()
        .map(|&triangle| facet(&surface, triangle))
        .collect::<io::Result<Vec<_>>>()?;
    let mut bytes = Vec::new();
    stl_io::write_stl(&mut bytes, facets.iter())?;
    if in_world {
        // The header holds nothing otherwise.
        bytes[..HEADER][..WORLD.len()].copy_from_slice(WORLD.as_bytes());
    }
    writer.write_all(&bytes)
}

fn facet(surface: &Surface<'_>, triangle: [usize; 3]) -> io::Result<stl_io::Triangle> {
    let mut corners = [[0.0; 3]; 3];
    for (place, index) in corners.iter_mut().zip(triangle) {
        corner(surface, index)?;
        *place = surface.vertices[index];
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
        surface_to(&mut bytes, surface(&triangles), true).unwrap();
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
        assert!(surface_to(&mut Vec::new(), surface(&[[0, 1, 4]]), false).is_err());
    }
}
