//! Surfaces as VTK XML files of polygons, with binary data behind the text.

use std::io::{self, Write};

use super::{WORLD, corner};
use shapespace_picture::Surface;

/// Writes a surface; points in double precision.
pub(super) fn surface_to(
    writer: &mut impl Write,
    surface: Surface<'_>,
    in_world: bool,
) -> io::Result<()> {
    let (points, cells) = (surface.vertices.len(), surface.triangles.len());
    // Every array has its number of bytes before it.
    let header = size_of::<u64>();
    let corners_at = header + 3 * size_of::<f64>() * points;
    let ends_at = corners_at + header + 3 * size_of::<i32>() * cells;
    let space = if in_world {
        state(WORLD)
    } else {
        String::new()
    };
    let array = |name: &str, kind: &str, offset: usize| {
        format!("<DataArray type=\"{kind}\" {name} format=\"appended\" offset=\"{offset}\"/>\n")
    };
    write!(
        writer,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" \
         byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n{space}<Piece \
         NumberOfPoints=\"{points}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"{cells}\">\n<Points>\n{}</Points>\n<Polys>\n{}{}</Polys>\n</Piece>\n\
         </PolyData>\n<AppendedData encoding=\"raw\">\n_",
        array("Name=\"Points\" NumberOfComponents=\"3\"", "Float64", 0),
        array("Name=\"connectivity\"", "Int32", corners_at),
        array("Name=\"offsets\"", "Int32", ends_at),
    )?;
    let length = |width: usize, count: usize| ((width * count) as u64).to_le_bytes();
    writer.write_all(&length(size_of::<f64>(), 3 * points))?;
    for x in surface.vertices.as_flattened() {
        writer.write_all(&x.to_le_bytes())?;
    }
    writer.write_all(&length(size_of::<i32>(), 3 * cells))?;
    for &index in surface.triangles.as_flattened() {
        writer.write_all(&corner(&surface, index)?.to_le_bytes())?;
    }
    writer.write_all(&length(size_of::<i32>(), cells))?;
    for number in 1..=cells {
        let end = i32::try_from(3 * number).map_err(io::Error::other)?;
        writer.write_all(&end.to_le_bytes())?;
    }
    writer.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}

/// A name and its value as an array of letters, as VTK stores them.
fn state(statement: &str) -> String {
    let (name, value) = statement.split_once('=').unwrap_or((statement, ""));
    let letters: Vec<String> = value.bytes().chain([0]).map(|b| b.to_string()).collect();
    format!(
        "<FieldData>\n<DataArray type=\"String\" Name=\"{name}\" NumberOfTuples=\"1\" \
         format=\"ascii\">\n{}\n</DataArray>\n</FieldData>\n",
        letters.join(" ")
    )
}
