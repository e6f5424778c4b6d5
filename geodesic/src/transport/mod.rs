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
use fe_grid::{Grid, ScalarField, compiled_once};
use plan::Coupling;

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
    let [there, back] = Coupling::new(&clouds[0], &clouds[1], grid).targets();
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
    let grids = start.grid().hierarchy(2);
    let clouds = |grid: &Grid<D>| [start, end].map(|shape| Cloud::new(&on_grid(grid, shape)));
    let few = |clouds: &[Cloud<D>; 2]| clouds.iter().all(|cloud| cloud.len() <= JUDGED);
    let found = grids.iter().rev().map(|grid| (grid, clouds(grid)));
    let (grid, [from, to]) = found.into_iter().find(|(_, clouds)| few(clouds))?;
    if from.nodes.is_empty() || to.nodes.is_empty() {
        return None;
    }
    let [linear, distances] = Coupling::new(&from, &to, grid).costs();
    Some(OF_DISTANCES.mul_add(distances, linear))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot's arm on its base, with the directions of its three parts in degrees.
    fn robot(degrees: [f64; 3]) -> ScalarField<f64, 2> {
        let mut joints = vec![[0.33, 0.12], [0.67, 0.12], [0.5, 0.17]];
        for (k, (degrees, length)) in degrees.iter().zip([0.25, 0.21, 0.15]).enumerate() {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let [x, y] = joints[2 + k];
            joints.push([x + length * cos, y + length * sin]);
        }
        let parts = [(0, 1, 0.05), (2, 3, 0.04), (3, 4, 0.032), (4, 5, 0.025)];
        ScalarField::from_fn(Grid::cube(65), |[x, y]| {
            let part = |&(from, to, radius): &(usize, usize, f64)| {
                let (a, b) = (joints[from], joints[to]);
                let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                let along = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy);
                let along = along.clamp(0.0, 1.0);
                radius - (x - a[0] - along * dx).hypot(y - a[1] - along * dy)
            };
            [parts.iter().map(part).fold(f64::MIN, f64::max)]
        })
    }

    /// The mean of the nodes inside.
    fn centre(shape: &ScalarField<f64, 2>) -> [f64; 2] {
        let points = Cloud::new(shape).points;
        std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64)
    }

    /// A shape that is turned about its centre and moved onto that of another one.
    fn turned_onto(
        shape: &ScalarField<f64, 2>,
        other: &ScalarField<f64, 2>,
        degrees: f64,
    ) -> ScalarField<f64, 2> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (own, to) = (centre(shape), centre(other));
        ScalarField::from_fn(*shape.grid(), |[x, y]| {
            let (x, y) = (x - to[0], y - to[1]);
            shape.sample([own[0] + cos * x + sin * y, own[1] - sin * x + cos * y])
        })
    }

    /// Upside down, the base of a robot overlaps the gripper that has swung aside, and points move less; distances
    /// within the robot tell the poses apart.
    #[test]
    fn a_robot_is_not_taken_for_one_upside_down() {
        let (straight, swung) = (robot([90.0, 45.0, 0.0]), robot([60.0, 140.0, 190.0]));
        let least = |around: f64| {
            let poses = [-30.0, -15.0, 0.0, 15.0, 30.0].map(|by| around + by);
            let costs = poses.map(|degrees| {
                transport_cost(&turned_onto(&straight, &swung, degrees), &swung).unwrap()
            });
            costs.into_iter().fold(f64::MAX, f64::min)
        };
        // By distances in space alone the wrong pose costs a third of the right one.
        let (right, wrong) = (least(0.0), least(180.0));
        assert!(right < 0.8 * wrong, "{right} {wrong}");
    }
}
