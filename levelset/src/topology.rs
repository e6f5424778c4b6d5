//! Numbers of parts, holes and tunnels: what deformations keep.
//!
//! An object is the set of nodes inside with the edges, faces and cells of the grid between them; nodes outside that
//! touch by a corner belong together. In the plane a hole is a component of the outside that the border does not
//! reach. In space that is a cavity; a tunnel, such as that of a ring, is open on both sides. The number of tunnels
//! is the first Betti number, by the formula of Euler and Poincare: parts less tunnels plus cavities are nodes less
//! edges plus faces less cells.

use fe_grid::{Field, Grid, compiled_once};

use crate::components::{Adjacency, components};
use crate::inspect::on_border;

/// Depth in spacings from which a part or a hole counts: that of three cells, which a grid resolves.
const RESOLVED: f64 = 1.5;
/// Half the least width of a tunnel that counts, and half the least thickness of the matter around it, in spacings.
/// Depths are known at nodes only, and are up to .9 spacings less than they are between them; levels are not.
const RESOLVED_TUNNEL: f64 = 1.0;
/// Depth in spacings of those that another object must have.
const FAINT: f64 = 0.5;

/// The numbers of parts of an object, of its holes, which the outside does not reach, and, in space, of its tunnels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Topology {
    /// Of those that the grid resolves.
    resolved: [usize; 3],
    /// Of those that it shows.
    all: [usize; 3],
}

impl Topology {
    /// Counts those of an object given by its signed distance, positive inside. A tunnel is resolved if it remains,
    /// whether the boundary is moved by a spacing inwards or outwards.
    pub fn of<const D: usize>(distance: &Field<f64, D, 1>) -> Self {
        let h = distance.grid().spacing();
        let depths = [RESOLVED, FAINT].map(|depth| depth * h);
        let [resolved, all] = parts_and_holes(distance, depths);
        let mut found = Self {
            resolved: [resolved[0], resolved[1], 0],
            all: [all[0], all[1], 0],
        };
        if D == 3 {
            let here = tunnels(distance, 0.0);
            let moved = |depth: f64| [depth * h, -depth * h].map(|level| tunnels(distance, level));
            if here > 0 {
                found.resolved[2] = moved(RESOLVED_TUNNEL).into_iter().fold(here, usize::min);
            }
            found.all[2] = moved(FAINT).into_iter().fold(here, usize::max);
        }
        found
    }

    /// The number of parts, holes and tunnels that one of two objects has and the other one has not: of those that
    /// the grid resolves, against all of the other object.
    pub fn differences(&self, other: &Self) -> usize {
        let missing =
            |own: &Self, other: &Self, k: usize| own.resolved[k].saturating_sub(other.all[k]);
        (0..3)
            .map(|k| missing(self, other, k).max(missing(other, self, k)))
            .sum()
    }
}

/// The numbers of parts of an object, given by its signed distance (positive inside), and of its holes: of those that
/// are somewhere at least so deep, for several depths.
pub fn parts_and_holes<const D: usize, const N: usize>(
    distance: &Field<f64, D, 1>,
    depths: [f64; N],
) -> [[usize; 2]; N] {
    let (grid, values) = (distance.grid(), distance.as_slice());
    // The depth of each component, none for those that are open.
    let depths_of = |sign: f64, adjacency: Adjacency, is_open: &dyn Fn(usize) -> bool| {
        let found = components(grid, &|index| sign * values[index] > 0.0, adjacency);
        let mut depth = vec![Some(0.0f64); found.sizes.len()];
        for (index, &label) in found.labels.iter().enumerate() {
            if let Some(place) = (label as usize).checked_sub(1) {
                let deeper = |depth: f64| depth.max(sign * values[index]);
                depth[place] = depth[place].filter(|_| !is_open(index)).map(deeper);
            }
        }
        depth
    };
    let parts = depths_of(1.0, Adjacency::Edges, &|_| false);
    let holes = depths_of(-1.0, Adjacency::Corners, &|index| on_border(grid, index));
    let count = |found: &[Option<f64>], least: f64| {
        let depths = found.iter().flatten();
        depths.filter(|depth| **depth >= least).count()
    };
    depths.map(|least| [count(&parts, least), count(&holes, least)])
}

/// The number of tunnels of the object `{distance > level}` in space; in the plane, that of its holes.
pub fn tunnels<const D: usize>(distance: &Field<f64, D, 1>, level: f64) -> usize {
    let (grid, values) = (distance.grid(), distance.as_slice());
    let inside: Vec<bool> = values.iter().map(|&value| value > level).collect();
    let parts = components(grid, &|index| inside[index], Adjacency::Edges);
    let parts = parts.sizes.len() as i64;
    let cavities = if D == 3 {
        let outside = components(grid, &|index| !inside[index], Adjacency::Corners);
        let mut open = vec![false; outside.sizes.len()];
        for (index, &label) in outside.labels.iter().enumerate() {
            if label > 0 && on_border(grid, index) {
                open[label as usize - 1] = true;
            }
        }
        open.iter().filter(|open| !**open).count() as i64
    } else {
        0
    };
    let tunnels = parts + cavities - euler_number(grid, &inside);
    usize::try_from(tunnels).unwrap_or(0)
}

compiled_once! {
    /// Nodes less edges plus faces less cells of which all corners lie inside.
    fn euler_number<'a, D>(grid: &'a Grid<D>, inside: &'a [bool]) -> i64 = euler_number_in;
}

fn euler_number_in<const D: usize>(grid: &Grid<D>, inside: &[bool]) -> i64 {
    let (n_nodes, strides) = (grid.nodes_per_axis(), grid.strides());
    let mut number = 0;
    for index in (0..grid.n_nodes()).filter(|index| inside[*index]) {
        let node = grid.node(index);
        // The axes along which an edge, face or cell goes on from its first corner.
        for axes in 0..1usize << D {
            let fits = (0..D).all(|k| axes >> k & 1 == 0 || node[k] + 1 < n_nodes[k]);
            // All subsets of the axes: its corners.
            let filled = || {
                (0..1usize << D)
                    .filter(|corner| corner & !axes == 0)
                    .all(|corner| {
                        let steps = (0..D).map(|k| (corner >> k & 1) * strides[k]);
                        inside[index + steps.sum::<usize>()]
                    })
            };
            if fits && filled() {
                number += if axes.count_ones() % 2 == 0 { 1 } else { -1 };
            }
        }
    }
    number
}
