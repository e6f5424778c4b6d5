//! Where groups differ in 3D: the boundary of the average in the colours of what was found there.

use serde_json::Value;
use shapespace_input::read_mesh;

use super::mesh::Mesh;
use super::scene::Scene;
use super::source::Source;
use super::values::{one, text};
use crate::compare::{difference_bar, rate_bar, rate_share};
use crate::output::names::{BOUNDARY, DIFFERENCE, RATE};

/// The boundary of a comparison, if it has one in 3D.
pub(super) fn shaded(source: &Source<'_>) -> Option<Scene> {
    let dimension = one(&source.record, "/dimension").and_then(Value::as_u64);
    if text(&source.record, "/command") != "compare" || dimension != Some(3) {
        return None;
    }
    let mesh = read_mesh(&source.path(&format!("{BOUNDARY}.vtp"))).ok()?;
    let table = Columns::read(&source.text(&format!("{BOUNDARY}.csv"))?)?;
    let (name, differences) = table.beginning(DIFFERENCE)?;
    let (_, rates) = table.beginning(RATE)?;
    if differences.len() != mesh.points.len() {
        return None;
    }
    let most = differences.iter().copied().fold(0.0, f64::max);
    // The column has the unit of lengths, if it is not that of the box.
    let unit = name.strip_prefix(DIFFERENCE)?.trim_start_matches('_');
    let unit = if unit.is_empty() { "unit box" } else { unit };
    let share = |difference: &f64| difference / most.max(f64::MIN_POSITIVE);
    let values = vec![
        differences.iter().map(share).collect(),
        rates.iter().copied().map(rate_share).collect(),
    ];
    let mesh = Mesh {
        points: mesh.points,
        triangles: mesh.triangles,
        values,
    };
    Some(Scene {
        title: "where the groups differ".into(),
        frames: vec![("average".into(), mesh)],
        bars: vec![difference_bar(most, unit), rate_bar()],
        ..Scene::default()
    })
}

/// The columns of a table of numbers, with their names.
struct Columns(Vec<(String, Vec<f64>)>);

impl Columns {
    fn read(text: &str) -> Option<Self> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let head = reader.headers().ok()?.iter();
        let mut columns: Vec<_> = head.map(|name| (name.to_owned(), Vec::new())).collect();
        for row in reader.records() {
            let row = row.ok()?;
            for ((_, values), cell) in columns.iter_mut().zip(&row) {
                values.push(cell.parse().ok()?);
            }
        }
        Some(Self(columns))
    }

    /// The first column whose name begins so.
    fn beginning(&self, start: &str) -> Option<(&str, &[f64])> {
        let (name, values) = self.0.iter().find(|(name, _)| name.starts_with(start))?;
        Some((name, values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_their_beginnings() {
        let table = Columns::read("x,difference_mm\n1,2.5\n3,4\n").unwrap();
        let (name, values) = table.beginning("difference").unwrap();
        assert_eq!((name, values), ("difference_mm", &[2.5, 4.0][..]));
        assert!(table.beginning("f").is_none());
        assert!(Columns::read("x,y\n1,a\n").is_none());
    }
}
