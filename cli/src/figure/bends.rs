//! Deformations by large angles, and the parameters that they require.

use shape_average::AverageParams;
use shapespace_report::table::{Cell, Table};

use super::averages::{columns, usual};
use super::scene::{Scene, distance, outline};
use super::sheet::{Sheet, Tiles};
use crate::error::CliError;

/// A way to compute an average.
type Way = (&'static str, fn(&mut AverageParams, usize));

/// The default, and its ingredients left out one by one.
const WAYS: [Way; 5] = [
    ("default", |_, _| ()),
    ("on the finest grid only", |params, nodes| {
        params.coarsest_nodes = nodes;
    }),
    ("by alternating descent", |params, _| {
        params.solver = shape_average::Solver::Descent;
    }),
    ("void stiffness 1e-2", |params, _| {
        params.void_stiffness = 1e-2;
    }),
    ("border of the box held", |params, _| {
        params.boundary = shape_average::BoundaryCondition::Identity;
    }),
];

/// Averages in all ways.
pub(super) fn large_bends<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let nodes = scene.grid().nodes_per_axis()[0];
    let mut tiles = Tiles::new(&scene.grid(), 3);
    tiles.shapes("shapes", &scene.distances, 0.0);
    let mut results = Vec::new();
    for (label, change) in WAYS {
        let result = scene.average(label, |params| change(params, nodes))?;
        tiles.average(label, &result);
        results.push(result);
    }
    let first = outline(&results[0])?;
    let mut table = Table::new(columns(
        &["way"],
        &["energy", "iterations", "distance to the first"],
    ));
    for ((label, _), result) in WAYS.iter().zip(&results) {
        let mut row: Vec<Cell> = vec![(*label).into()];
        row.extend(usual(result));
        let iterations: usize = result.levels.iter().map(|level| level.iterations).sum();
        row.extend([
            result.energy.total.into(),
            iterations.into(),
            distance(&outline(result)?, &first)?.into(),
        ]);
        table.row(row);
    }
    Ok(Sheet {
        title: "Large bends",
        text:
            "Arms bent by 51 degrees to either side have the straight cross as their average. This \
               requires the levels from coarse grids to fine: on the finest grid alone the \
               minimisation ends in a state of higher energy, with arms cut off."
                .into(),
        table,
        picture: tiles.draw(),
    })
}
