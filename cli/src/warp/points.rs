//! Landmarks, outlines and surfaces that are carried point by point.

use std::path::{Path, PathBuf};

use super::draw::{self, Pair};
use super::map::StoredMap;
use super::route::WorldMap;
use crate::error::CliError;
use crate::output::outline::write_drawing;
use crate::output::surface::write_surface;
use crate::output::{OutputError, ResultDir};
use shapespace_input::{InputError, bytes_of, extension_of, read_mesh, read_outline};
use shapespace_picture::{Shape, Surface};

/// A file that was carried.
pub(super) struct Moved {
    /// Its name in the results.
    pub name: PathBuf,
    pub what: &'static str,
    /// What it has, how many of these, and how many of them have no exact place.
    pub unit: &'static str,
    pub count: usize,
    pub inexact: usize,
    /// How many lie outside of the box of the grid, where deformations are not computed.
    pub outside: usize,
    /// The share of the objects of a label image that lies there: it is left out.
    pub lost: f64,
    /// Pictures of it before and after, if it can be shown.
    pub pictures: Option<Pair>,
}

/// A map of points that counts.
struct Mover<'a> {
    map: &'a WorldMap,
    small: f64,
    count: usize,
    inexact: usize,
    outside: usize,
}

/// Points that are shown in pictures.
const MOST_SHOWN: usize = 20_000;

impl<'a> Mover<'a> {
    fn new(stored: &StoredMap, map: &'a WorldMap) -> Self {
        Self {
            map,
            small: stored.small(),
            count: 0,
            inexact: 0,
            outside: 0,
        }
    }

    fn point(&mut self, position: [f64; 3]) -> [f64; 3] {
        let found = self.map.point(position);
        self.count += 1;
        self.inexact += usize::from(found.defect > self.small);
        self.outside += usize::from(found.outside > self.small);
        found.position
    }

    fn moved(&self, name: PathBuf, what: &'static str, pictures: Option<Pair>) -> Moved {
        Moved {
            pictures,
            name,
            what,
            unit: "points",
            count: self.count,
            inexact: self.inexact,
            outside: self.outside,
            lost: 0.0,
        }
    }
}

fn malformed(path: &Path, format: &'static str, reason: impl Into<String>) -> CliError {
    CliError::Input(InputError::Malformed {
        path: path.into(),
        format,
        reason: reason.into(),
    })
}

/// The columns of the coordinates: those of their names in a first line, with a unit or without (`x`, `x_mm`), or the
/// first ones. `None` where names leave open which of more columns these are.
fn columns_of(columns: &[String], dimension: usize) -> Option<Vec<usize>> {
    let has_name = |column: &str, axis: char| {
        let mut letters = column.trim().chars();
        let first = letters.next();
        first.is_some_and(|first| first.eq_ignore_ascii_case(&axis))
            && letters.next().is_none_or(|next| !next.is_alphanumeric())
    };
    let place = |axis: &char| columns.iter().position(|column| has_name(column, *axis));
    let named: Option<Vec<usize>> = ['x', 'y', 'z'][..dimension].iter().map(place).collect();
    let is_number = |column: &String| column.trim().parse::<f64>().is_ok();
    let clear = columns.len() <= dimension || columns[..dimension].iter().all(is_number);
    named.or_else(|| clear.then(|| (0..dimension).collect()))
}

/// The fields of a line, without the quotes around those that have commas.
fn fields_of(line: &str) -> Vec<String> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .from_reader(line.as_bytes());
    // Any text is a row: quotes that are not closed end with the line.
    let row = reader.records().next().and_then(Result::ok);
    row.map_or_else(Vec::new, |row| row.iter().map(str::to_owned).collect())
}

/// A line of these fields.
fn line_of(fields: &[String]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let written = writer.write_record(fields).ok();
    let bytes = written.and_then(|()| writer.into_inner().ok());
    // What is written to memory and came from text.
    let line = String::from_utf8(bytes.unwrap_or_default()).unwrap_or_default();
    line.trim_end_matches('\n').to_owned()
}

/// Writes points at their new places. The columns x, y and, of volumes, z are the first ones or have these
/// names; the others, a first line of names and lines of remarks (`#`) are kept.
pub(super) fn moved_landmarks(
    (path, stem): (&Path, &str),
    directory: &ResultDir,
    (stored, map): (&StoredMap, &WorldMap),
) -> Result<Moved, CliError> {
    let text = String::from_utf8(bytes_of(path)?)
        .map_err(|_| malformed(path, "CSV", "it is not text in UTF-8"))?;
    let dimension = stored.dimension();
    let mut mover = Mover::new(stored, map);
    let mut moved = String::new();
    let mut places: Option<Vec<usize>> = None;
    let mut shown: [Vec<[f64; 3]>; 2] = Default::default();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim_end();
        if line.is_empty() || line.starts_with('#') {
            moved += line;
            moved.push('\n');
            continue;
        }
        let mut columns = fields_of(line);
        let own = places.clone().or_else(|| columns_of(&columns, dimension));
        let own = own.ok_or_else(|| {
            let names = &["x", "y", "z"][..dimension].join(", ");
            let reason = format!(
                "line {} names no columns {names}: call those of the coordinates so, or leave this line out and \
                 have them first",
                number + 1
            );
            malformed(path, "CSV", reason)
        })?;
        let numbers: Vec<f64> = own
            .iter()
            .filter_map(|&place| columns.get(place)?.trim().parse().ok())
            .filter(|x: &f64| x.is_finite())
            .collect();
        if numbers.len() == dimension {
            let position = std::array::from_fn(|k| numbers.get(k).copied().unwrap_or(0.0));
            let there = mover.point(position);
            if shown[0].len() < MOST_SHOWN {
                shown[0].push(position);
                shown[1].push(there);
            }
            for (&place, x) in own.iter().zip(there) {
                columns[place] = format!("{x:.6}");
            }
            moved += &line_of(&columns);
            places = Some(own);
        } else if places.is_none() && columns.len() >= dimension && numbers.is_empty() {
            moved += line;
            places = Some(own);
        } else {
            let reason = format!("line {} does not have {dimension} coordinates", number + 1);
            return Err(malformed(path, "CSV", reason));
        }
        moved.push('\n');
    }
    if mover.count == 0 {
        return Err(malformed(path, "CSV", "it has no points"));
    }
    let name = PathBuf::from(format!("{stem}.csv"));
    let file = directory.file(&name);
    std::fs::write(&file, moved).map_err(OutputError::at(&file))?;
    let pictures = draw::points(&shown[0], &shown[1]);
    Ok(mover.moved(name, "points", Some(pictures)))
}

/// Pieces of the edges of a drawing, along its longer side: straight edges do not stay straight.
const PIECES: f64 = 512.0;

/// Writes the filled shapes of a drawing at their new places.
pub(super) fn moved_drawing(
    (path, stem): (&Path, &str),
    directory: &ResultDir,
    (stored, map): (&StoredMap, &WorldMap),
) -> Result<Moved, CliError> {
    if stored.dimension() == 3 {
        return Err(CliError::Option {
            option: "FILE",
            value: format!("'{}', a drawing,", path.display()),
            remedy: "give volumes, surfaces or points: the shapes of the result are solid".into(),
        });
    }
    let mut mover = Mover::new(stored, map);
    let filled = read_outline(path)?;
    let [low, high] = filled.whole().bounds();
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let (mut parts, mut before) = (Vec::new(), Vec::new());
    for (outline, fill) in filled.parts() {
        let shape = Shape::of(&outline.refined(extent / PIECES));
        before.extend(shape.closed_curves().into_iter().map(<[_]>::to_vec));
        let curves = shape.closed_curves().into_iter().map(|curve| {
            let there = |[x, y]: &[f64; 2]| {
                let [x, y, _] = mover.point([*x, *y, 0.0]);
                [x, y]
            };
            curve.iter().map(there).collect::<Vec<_>>()
        });
        parts.push((curves.collect::<Vec<_>>(), *fill));
    }
    let drawn = parts.iter().map(|(curves, fill)| {
        let curves = curves.iter().map(Vec::as_slice);
        (curves.collect(), *fill)
    });
    let name = PathBuf::from(format!("{stem}.svg"));
    write_drawing(&directory.file(&name), &drawn.collect::<Vec<_>>())?;
    let after: Vec<_> = parts.into_iter().flat_map(|(curves, _)| curves).collect();
    let pictures = draw::curves(&before, &after);
    Ok(mover.moved(name, "drawing", Some(pictures)))
}

/// Writes a surface whose corners are at their new places.
pub(super) fn moved_surface(
    (path, stem): (&Path, &str),
    directory: &ResultDir,
    (stored, map): (&StoredMap, &WorldMap),
) -> Result<Moved, CliError> {
    if stored.dimension() == 2 {
        return Err(CliError::Option {
            option: "FILE",
            value: format!("'{}', a surface,", path.display()),
            remedy: "give images or points: the shapes of the result are flat".into(),
        });
    }
    let mut mover = Mover::new(stored, map);
    let mesh = read_mesh(path)?;
    let vertices: Vec<[f64; 3]> = mesh.points.iter().map(|&p| mover.point(p)).collect();
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| corner as usize);
    let triangles: Vec<[usize; 3]> = mesh.triangles.iter().map(corners).collect();
    let surface = Surface {
        vertices: &vertices,
        triangles: &triangles,
    };
    let extension = extension_of(path);
    // Formats that are read only are written in the one that is nearest.
    let written = match &*extension {
        "obj" => "ply",
        "vtk" => "vtp",
        other => other,
    };
    let name = PathBuf::from(format!("{stem}.{written}"));
    write_surface(&directory.file(&name), surface, &[], stored.in_world())?;
    let pictures = draw::surfaces(&mesh, &vertices);
    Ok(mover.moved(name, "surface", pictures))
}
