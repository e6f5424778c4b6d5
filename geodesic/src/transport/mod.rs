//! Where the points of one shape go in another one, by the optimal transport of its volume.
//!
//! Minimisers follow the gradient of a mismatch, which is local: where a finger of one hand covers parts of two
//! fingers of the other one, it may become a part of both. A transport is global. It carries the uniform measure of
//! one shape to that of the other one such that points move little, and keep their distances within the shape: what is
//! covered twice has to go elsewhere, and every finger goes to one. It is neither continuous nor an elastic
//! deformation, but a path that is attracted to its targets is a start in the right valley
//! ([`PathObjective::towards`](crate::PathObjective)).
//!
//! It is computed on a coarse grid, whose nodes inside of the shapes are the points of the measures.

mod cloud;
mod plan;

use crate::shape::{Shape, on_grid};
use cloud::Cloud;
use fe_grid::Grid;

/// Nodes of a grid inside of a shape, and where they are carried.
#[derive(Clone, Debug)]
pub(crate) struct Targets<const D: usize> {
    pub nodes: Vec<usize>,
    pub points: Vec<[f64; D]>,
    /// The distance between neighbouring nodes.
    pub spacing: f64,
}

impl<const D: usize> Targets<D> {
    /// The same points as nodes of a grid that is finer by a power of two.
    pub fn on_finer(&self, grid: &Grid<D>, finer: &Grid<D>) -> Self {
        let ratio = (grid.spacing() / finer.spacing()).round() as usize;
        let node = |&node: &usize| finer.node_index(grid.node(node).map(|i| ratio * i));
        Self {
            nodes: self.nodes.iter().map(node).collect(),
            points: self.points.clone(),
            spacing: self.spacing,
        }
    }
}

/// Computes the targets of the nodes inside of two shapes, each in the other one; `None` where no node lies inside of
/// one of them.
pub(crate) fn transport<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    grid: &Grid<D>,
) -> Option<[Targets<D>; 2]> {
    let clouds = [start, end].map(|shape| Cloud::new(&on_grid(grid, &shape.union())));
    if clouds.iter().any(|cloud| cloud.nodes.is_empty()) {
        return None;
    }
    let [there, back] = plan::targets(&clouds[0], &clouds[1], grid);
    let [start, end] = clouds.map(|cloud| cloud.nodes);
    let spacing = grid.spacing();
    Some(
        [(start, there), (end, back)].map(|(nodes, points)| Targets {
            nodes,
            points,
            spacing,
        }),
    )
}
