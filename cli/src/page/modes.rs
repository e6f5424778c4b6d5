//! Modes of variation in 3D: the average object, and where its points move.

use std::path::Path;

use fe_grid::{Grid, ScalarField, VectorField};
use levelset::{BoxEdge, contour};
use serde_json::Value;

use super::mesh::Mesh;
use super::scene::Scene;
use super::source::Source;
use super::values::{at, one, text};
use crate::output::numbered;
use crate::results::stored_grid;
use shapespace_input::read_array;

/// Most modes with a slider.
const MOST: usize = 5;
/// Most nodes a side of a cube, and as many in all of a box: finer surfaces have too many triangles for a page, and fields take too long to
/// read.
const NODES: usize = 129;

/// A mode, with the standard deviation of its score.
pub(super) struct Mode {
    pub name: String,
    field: VectorField<f64, 3>,
    deviation: f64,
}

impl Mode {
    /// Where points move per unit of score: a shape of score `s` is `(1 - s sqrt Lambda y)(S)`.
    pub fn offsets(&self, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let moved = |p: &[f64; 3]| self.field.sample(*p).map(|u| -self.deviation * u);
        points.iter().map(moved).collect()
    }
}

/// The modes of an analysis of volumes.
pub(super) fn modes(source: &Source<'_>) -> Option<Scene> {
    let record = &source.record;
    let dimension = one(record, "/dimension").and_then(Value::as_u64);
    if text(record, "/command") != "pca" || dimension != Some(3) {
        return None;
    }
    let spacing = one(record, "/spacing").and_then(Value::as_f64);
    let object = scalar(&source.path("object.npy"), spacing)?;
    // Images vary in the whole box.
    if object.as_slice().iter().all(|inside| *inside > 0.5) {
        return None;
    }
    let outline = contour(&object, 0.5, BoxEdge::Closed).ok()?;
    let mesh = Mesh {
        points: outline.points().to_vec(),
        triangles: outline.simplices().to_vec(),
        values: Vec::new(),
    };
    let eigenvalues = at(record, "/eigenvalues/*").into_iter().flatten();
    let mode = |(j, value): (usize, &Value)| {
        Some(Mode {
            name: format!("mode {j}"),
            field: vector(
                object.grid(),
                &source.path(numbered("mode", j, "npy").to_str()?),
            )?,
            deviation: value.as_f64().filter(|value| *value > 0.0)?.sqrt(),
        })
    };
    Some(Scene {
        title: "average and modes".into(),
        frames: vec![("average".into(), mesh)],
        modes: eigenvalues.take(MOST).enumerate().map_while(mode).collect(),
        amplitude: one(record, "/parameters/amplitude")
            .and_then(Value::as_f64)
            .unwrap_or(2.0),
        ..Scene::default()
    })
}

/// A field, unless it has too many nodes.
fn scalar(path: &Path, spacing: Option<f64>) -> Option<ScalarField<f64, 3>> {
    let (size, values) = read_array(path).ok()?;
    let grid = stored_grid(&size, spacing)?;
    let few = grid.n_nodes() <= NODES.pow(3);
    ScalarField::from_vec(few.then_some(grid)?, values).ok()
}

/// A field of vectors on a grid.
fn vector(grid: &Grid<3>, path: &Path) -> Option<VectorField<f64, 3>> {
    let (size, values) = read_array(path).ok()?;
    let nodes = grid.nodes_per_axis();
    let fits = size.len() == 4 && size[..3] == nodes[..] && size[3] == 3;
    VectorField::from_vec(*grid, fits.then_some(values)?).ok()
}
