//! Surfaces as VTK XML files of polygons, with binary data behind the text.

use std::fmt::Write as _;
use std::io::{self, Write};

use crate::output::vti::escaped;

use super::{PointArray, WORLD, corner};
use shapespace_picture::Surface;

/// Writes a surface; points in double precision, arrays in single precision.
pub(super) fn surface_to(
    writer: &mut impl Write,
    surface: Surface<'_>,
    arrays: &[PointArray<'_>],
    in_world: bool,
) -> io::Result<()> {
    let (points, cells) = (surface.vertices.len(), surface.triangles.len());
    // Every array has its number of bytes before it.
    let header = size_of::<u64>();
    let corners_at = header + 3 * size_of::<f64>() * points;
    let ends_at = corners_at + header + 3 * size_of::<i32>() * cells;
    let own = |array: &PointArray<'_>| header + size_of::<f32>() * array.components * points;
    let mut at = ends_at + header + size_of::<i32>() * cells;
    let mut data = String::new();
    for array in arrays {
        if array.values.len() != array.components * points {
            let message = format!("the array '{}' does not fit its surface", array.name);
            return Err(io::Error::new(io::ErrorKind::InvalidData, message));
        }
        let (name, components) = (escaped(array.name), array.components);
        let _ = writeln!(
            data,
            "<DataArray type=\"Float32\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
             format=\"appended\" offset=\"{at}\"/>"
        );
        at += own(array);
    }
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
         NumberOfPolys=\"{cells}\">\n<PointData>\n{data}</PointData>\n<Points>\n{}</Points>\n<Polys>\n{}{}</Polys>\n</Piece>\n\
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
    for array in arrays {
        let count = array.components * points;
        writer.write_all(&length(size_of::<f32>(), count))?;
        for x in array.values {
            writer.write_all(&(*x as f32).to_le_bytes())?;
        }
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
