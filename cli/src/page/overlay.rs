//! Inputs in 3D with their ways onto the average, to be laid over it.

use shapespace_input::{read_mesh, read_point_array};

use super::mesh::Mesh;
use super::source::Source;
use super::values::{at, text};
use crate::output::names::{DISPLACEMENT, INPUT};

/// Most inputs that are laid over an average.
const MOST: usize = 24;

/// The surface of an input, with the components of the way of every point as its numbers.
pub(super) struct Overlay {
    pub name: String,
    pub mesh: Mesh,
}

impl Overlay {
    /// The ways of the points of its surface, which may have been joined.
    pub fn offsets(mesh: &Mesh) -> Vec<[f64; 3]> {
        let [x, y, z] = &mesh.values[..] else {
            return Vec::new();
        };
        let pairs = x.iter().zip(y).zip(z);
        pairs.map(|((x, y), z)| [*x, *y, *z]).collect()
    }
}

/// The inputs of an average; none for other surfaces than that of the average.
pub(super) fn overlays(source: &Source<'_>, stem: &str) -> Vec<Overlay> {
    if text(&source.record, "/command") != "average" || stem != "average" {
        return Vec::new();
    }
    let names = at(&source.record, "/input/*/name");
    let name_of = |number: usize| {
        let name = names.get(number).copied().flatten();
        name.and_then(|name| name.as_str()).unwrap_or_default()
    };
    let files = source.ending(".vtp").filter_map(|file| {
        let number = file.strip_prefix(INPUT)?.strip_prefix('_')?;
        Some((file, number.strip_suffix(".vtp")?.parse().ok()?))
    });
    let read = |(file, number): (&str, usize)| {
        let path = source.path(file);
        let mesh = read_mesh(&path).ok()?;
        let ways = read_point_array(&path, DISPLACEMENT).ok()?;
        let fits = ways.len() == 3 * mesh.points.len();
        let along = |k: usize| ways.iter().skip(k).step_by(3).copied().collect();
        fits.then(|| Overlay {
            name: name_of(number).to_owned(),
            mesh: Mesh {
                points: mesh.points,
                triangles: mesh.triangles,
                values: (0..3).map(along).collect(),
            },
        })
    };
    files.take(MOST).filter_map(read).collect()
}
