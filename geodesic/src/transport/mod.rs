//! Where the points of one shape go in another one, by the optimal transport of its volume.
//!
//! Minimisers follow the gradient of a mismatch, which is local: where a finger of one hand covers parts of two
//! fingers of the other one, it may become a part of both. A transport is global. It carries the uniform measure of
//! one shape to that of the other one such that points move little, and keep their distances within the shape: what is
//! covered twice has to go elsewhere, and every finger goes to one. Where a part of one shape is hidden,
//! what is not needed for its visible part is carried to where it is hidden. It is neither continuous nor an elastic
//! deformation, but a path that is attracted to its targets is a start in the right valley
//! ([`PathObjective::towards`](crate::PathObjective)).
//!
//! It is computed on a coarse grid, whose nodes inside of the shapes are the points of the measures.

mod cloud;
mod plan;

use crate::shape::{Shape, union_of};
use cloud::Cloud;
use fe_grid::{Grid, ScalarField, compiled_once};
use plan::Coupling;

/// Most points of a shape whose volume is transported: the cost grows with the third power of their number.
const TRANSPORTED: usize = 400;

/// Nodes of a grid inside of a shape, and where they are carried.
#[derive(Clone, Debug)]
pub(crate) struct Targets<const D: usize> {
    pub nodes: Vec<usize>,
    pub points: Vec<[f64; D]>,
    /// The distance between neighbouring nodes, which may be a multiple of the spacing of the grid.
    pub spacing: f64,
}

/// Computes the targets of nodes inside of two shapes, each in the other one, by the finest of some grids of one
/// hierarchy, from coarse to fine, with few points; they are nodes of the last one. `None` where all have many, or none.
pub(crate) fn transport<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    grids: &[Grid<D>],
) -> Option<[Targets<D>; 2]> {
    let on = |grid: &Grid<D>| {
        [start, end].map(|shape| {
            let shape = shape.on_grid(grid);
            let visible = shape.hidden().then(|| shape.visibility()).flatten();
            Cloud::new(&union_of(&shape.components), visible.as_ref())
        })
    };
    let (grid, clouds) = clouds(&on, grids, TRANSPORTED)?;
    let [there, back] = Coupling::new(&clouds[0], &clouds[1], &grid).targets();
    let finest = grids.last()?;
    let ratio = (grid.spacing() / finest.spacing()).round() as usize;
    let on_finest = |node: usize| finest.node_index(grid.node(node).map(|i| ratio * i));
    let [start, end] = clouds.map(|cloud| cloud.nodes);
    Some([(start, there), (end, back)].map(|(nodes, points)| {
        let carried = nodes.into_iter().zip(points);
        let carried = carried.filter_map(|(node, point)| Some((on_finest(node), point?)));
        let (nodes, points) = carried.unzip();
        Targets {
            nodes,
            points,
            spacing: grid.spacing(),
        }
    }))
}

/// The finest of some grids, from coarse to fine, on which both shapes have few points, and these; `None` where all have
/// many, or one of the shapes none.
fn clouds<const D: usize>(
    on: &dyn Fn(&Grid<D>) -> [Cloud<D>; 2],
    grids: &[Grid<D>],
    most: usize,
) -> Option<(Grid<D>, [Cloud<D>; 2])> {
    let mut found = grids.iter().rev().map(|grid| (*grid, on(grid)));
    let (grid, clouds) = found.find(|(_, both)| both.iter().all(|cloud| cloud.len() <= most))?;
    let empty = clouds.iter().any(|cloud| cloud.nodes.is_empty());
    (!empty).then_some((grid, clouds))
}

/// Most points of a shape whose pose is judged.
const JUDGED: usize = 150;
/// Weight of the changes of distances in the cost of a pose.
const OF_DISTANCES: f64 = 8.0;

compiled_once! {
    /// Computes what it costs to carry the volume of one shape to that of another one in their present positions, both
    /// given as signed distances on one grid: the mean squared distance of points from their targets, and eight times
    /// the mean squared change of distances within the shapes, by the transport for which both are little.
    ///
    /// In a wrong pose shapes may overlap better than in the right one, where limbs have moved; distances within
    /// them change less in the right one. `None` where a shape has no point on a coarse grid.
    pub fn transport_cost<'a, D>(
        start: &'a ScalarField<f64, D>,
        end: &'a ScalarField<f64, D>,
    ) -> Option<f64> = transport_cost_in;
}

fn transport_cost_in<const D: usize>(
    start: &ScalarField<f64, D>,
    end: &ScalarField<f64, D>,
) -> Option<f64> {
    let on = |grid: &Grid<D>| [start, end].map(|shape| Cloud::new(&shape.on_grid(grid), None));
    let (grid, [from, to]) = clouds(&on, &start.grid().hierarchy(2), JUDGED)?;
    let [linear, distances] = Coupling::new(&from, &to, &grid).costs();
    Some(OF_DISTANCES.mul_add(distances, linear))
}
