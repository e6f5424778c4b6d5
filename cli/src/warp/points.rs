//! Landmarks and surfaces that are carried point by point.

use std::path::Path;

use super::map::WorldMap;
use crate::error::CliError;
use crate::output::OutputError;
use crate::output::surface::write_surface;
use shapespace_input::{InputError, bytes_of, read_mesh};
use shapespace_picture::Surface;

fn malformed(path: &Path, format: &'static str, reason: impl Into<String>) -> CliError {
    CliError::Input(InputError::Malformed {
        path: path.into(),
        format,
        reason: reason.into(),
    })
}

/// Writes landmarks at their new places. The first three columns are x, y and z in millimetres
/// (RAS); the others, a first line of names and lines of remarks (`#`) are kept.
pub(super) fn moved_landmarks(
    path: &Path,
    file: &Path,
    map: &WorldMap,
) -> Result<&'static str, CliError> {
    let text = String::from_utf8(bytes_of(path)?)
        .map_err(|_| malformed(path, "CSV", "it is not text in UTF-8"))?;
    let mut moved = String::new();
    let mut named = false;
    for (number, line) in text.lines().enumerate() {
        let line = line.trim_end();
        let columns: Vec<&str> = line.split(',').collect();
        let numbers: Vec<f64> = columns
            .iter()
            .take(3)
            .filter_map(|column| column.trim().parse().ok())
            .filter(|x: &f64| x.is_finite())
            .collect();
        if let [x, y, z] = numbers[..] {
            let place = map.point([x, y, z]).map(|x| format!("{x:.6}"));
            let rest = columns[3..].iter().map(|column| (*column).to_owned());
            let columns: Vec<String> = place.into_iter().chain(rest).collect();
            moved += &columns.join(",");
            named = true;
        } else if line.is_empty() || line.starts_with('#') {
            moved += line;
        } else if !named && columns.len() >= 3 && numbers.is_empty() {
            moved += line;
            named = true;
        } else {
            let reason = format!("line {} does not begin with three numbers", number + 1);
            return Err(malformed(path, "CSV", reason));
        }
        moved.push('\n');
    }
    std::fs::write(file, moved).map_err(OutputError::at(file))?;
    Ok("landmarks")
}

/// Writes a surface whose corners are at their new places.
pub(super) fn moved_surface(
    path: &Path,
    file: &Path,
    map: &WorldMap,
) -> Result<&'static str, CliError> {
    let mesh = read_mesh(path)?;
    let vertices: Vec<[f64; 3]> = mesh.points.iter().map(|&p| map.point(p)).collect();
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| corner as usize);
    let triangles: Vec<[usize; 3]> = mesh.triangles.iter().map(corners).collect();
    let surface = Surface {
        vertices: &vertices,
        triangles: &triangles,
    };
    write_surface(file, surface, true)?;
    Ok("surface")
}
