//! Deformations by large angles, and the parameters that they require.

use levelset::Contour;
use shape_average::AverageParams;
use shapespace_report::table::Cell;

use super::scene::{Scene, distance, outline};
use super::sheet::{Comparison, Sheet};
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
    let last = ["energy", "iterations", "distance to the first"];
    let mut compared = Comparison::new(&scene.grid(), 3, &["way"], &last);
    compared.tiles.shapes("shapes", &scene.distances, 0.0);
    let mut first: Option<Contour<D>> = None;
    for (label, change) in WAYS {
        let result = scene.average(label, |params| change(params, nodes))?;
        let own = outline(&result)?;
        let apart = distance(&own, first.as_ref().unwrap_or(&own))?;
        first.get_or_insert(own);
        let iterations: usize = result.levels.iter().map(|level| level.iterations).sum();
        let last: [Cell; 3] = [result.energy.total.into(), iterations.into(), apart.into()];
        compared.add(label, [label], &result, last);
    }
    Ok(compared.sheet(
        "Large bends",
        "Arms bent by 51 degrees to either side have the straight cross as their average. This \
         requires the levels from coarse grids to fine: on the finest grid alone the minimisation \
         ends in a state of higher energy, with arms cut off.",
    ))
}
