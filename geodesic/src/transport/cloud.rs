//! The nodes inside of a shape, as a uniform measure, and the distances between them within it.

use fe_grid::{Grid, ScalarField, parallel};
use nalgebra::DMatrix;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The nodes inside of a shape, as a uniform measure.
pub(super) struct Cloud<const D: usize> {
    grid: Grid<D>,
    pub nodes: Vec<usize>,
    pub points: Vec<[f64; D]>,
    /// The nodes at which the shape is hidden.
    pub hidden: Vec<[f64; D]>,
    depths: Vec<f64>,
    /// The place of every node of the grid among those inside.
    places: Vec<Option<usize>>,
}

/// A point that is reached at a distance; the nearest is the greatest.
#[derive(PartialEq)]
struct Reached {
    distance: f64,
    place: usize,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        let nearer = other.distance.total_cmp(&self.distance);
        nearer.then(other.place.cmp(&self.place))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<const D: usize> Cloud<D> {
    /// Takes the nodes where a signed distance is positive; those at which the shape is visible, by weights of the nodes,
    /// if a part of it is hidden.
    pub fn new(distance: &ScalarField<f64, D>, visible: Option<&ScalarField<f64, D>>) -> Self {
        let grid = *distance.grid();
        let depth = |node: &usize| distance.as_slice()[*node];
        let is_visible =
            |node: &usize| visible.is_none_or(|weights| weights.as_slice()[*node] > 0.5);
        let inside = (0..grid.n_nodes()).filter(|node| depth(node) > 0.0);
        let nodes: Vec<usize> = inside.filter(is_visible).collect();
        let mut places = vec![None; grid.n_nodes()];
        for (place, &node) in nodes.iter().enumerate() {
            places[node] = Some(place);
        }
        Self {
            points: nodes.iter().map(|&n| grid.position(grid.node(n))).collect(),
            depths: nodes.iter().map(depth).collect(),
            hidden: (0..grid.n_nodes())
                .filter(|node| !is_visible(node))
                .map(|node| grid.position(grid.node(node)))
                .collect(),
            grid,
            nodes,
            places,
        }
    }

    /// The number of points.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// The squared distance of a point from one of another cloud, in space and depth.
    pub fn apart(&self, i: usize, other: &Self, j: usize) -> f64 {
        squared(&self.points[i], &other.points[j]) + (self.depths[i] - other.depths[j]).powi(2)
    }

    /// The squared distances of the points from where another cloud is hidden.
    pub fn apart_from_hidden(&self, other: &Self) -> Vec<f64> {
        parallel::map(&self.points, &|point| {
            let hidden = other.hidden.iter().map(|hidden| squared(point, hidden));
            hidden.fold(f64::INFINITY, f64::min)
        })
    }

    /// The distances of all pairs of points within the shape: the lengths of shortest paths along edges between nodes
    /// that are at most two apart along every axis; the distance in space where there is no path.
    pub fn within(&self) -> DMatrix<f64> {
        let edges = self.edges();
        let columns = parallel::map(0..self.len(), &|from| self.distances(from, &edges));
        DMatrix::from_vec(self.len(), self.len(), columns.concat())
    }

    fn distances(&self, from: usize, edges: &[Vec<(usize, f64)>]) -> Vec<f64> {
        let mut distances = vec![f64::INFINITY; self.len()];
        distances[from] = 0.0;
        let mut front = BinaryHeap::from([Reached {
            distance: 0.0,
            place: from,
        }]);
        while let Some(Reached { distance, place }) = front.pop() {
            if distance > distances[place] {
                continue;
            }
            for &(next, length) in &edges[place] {
                let by = distance + length;
                if by < distances[next] {
                    distances[next] = by;
                    front.push(Reached {
                        distance: by,
                        place: next,
                    });
                }
            }
        }
        for (distance, point) in distances.iter_mut().zip(&self.points) {
            if distance.is_infinite() {
                *distance = squared(point, &self.points[from]).sqrt();
            }
        }
        distances
    }

    /// The points that are at most two nodes away along every axis, with all nodes between inside, and their distances.
    fn edges(&self) -> Vec<Vec<(usize, f64)>> {
        let moves: Vec<[i64; D]> = (0..5_usize.pow(D as u32))
            .map(|code| std::array::from_fn(|k| (code / 5_usize.pow(k as u32) % 5) as i64 - 2))
            .filter(|step: &[i64; D]| step.iter().any(|s| s % 2 != 0))
            .collect();
        parallel::map(0..self.len(), &|place| {
            let node = self.grid.node(self.nodes[place]);
            moves
                .iter()
                .filter_map(|step| {
                    let next = self.inside(&node, step)?;
                    // The middle of a long step, rounded both ways.
                    let half = |up: i64| step.map(|s| (s + up).div_euclid(2));
                    let long = step.iter().any(|s| s.abs() == 2);
                    if long {
                        self.inside(&node, &half(0))?;
                        self.inside(&node, &half(1))?;
                    }
                    let length: i64 = step.iter().map(|s| s * s).sum();
                    Some((next, (length as f64).sqrt() * self.grid.spacing()))
                })
                .collect()
        })
    }

    /// The place of the node that is a step away, if it is inside.
    fn inside(&self, node: &[usize; D], step: &[i64; D]) -> Option<usize> {
        let mut next = *node;
        for ((next, step), n) in next.iter_mut().zip(step).zip(self.grid.nodes_per_axis()) {
            let index = *next as i64 + step;
            if index < 0 || index >= n as i64 {
                return None;
            }
            *next = index as usize;
        }
        self.places[self.grid.node_index(next)]
    }
}

fn squared<const D: usize>(x: &[f64; D], y: &[f64; D]) -> f64 {
    x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An annulus with a slit, and a disk apart from it.
    #[test]
    fn distances_go_around_slits_but_not_between_parts() {
        let grid = Grid::<2>::cube(65);
        let shape = ScalarField::from_fn(grid, |[x, y]| {
            let (dx, dy) = (x - 0.4, y - 0.5);
            let ring = 0.08 - (dx.hypot(dy) - 0.25).abs();
            let slit = if dx > 0.0 { dy.abs() - 0.03 } else { 1.0 };
            let disk = 0.06 - (x - 0.9).hypot(dy);
            [ring.min(slit).max(disk)]
        });
        let cloud = Cloud::new(&shape, None);
        let nearest = |x: f64, y: f64| {
            let place = |p: &[f64; 2]| (p[0] - x).hypot(p[1] - y);
            let points = cloud.points.iter().enumerate();
            let (place, _) = points
                .min_by(|a, b| place(a.1).total_cmp(&place(b.1)))
                .unwrap();
            place
        };
        let within = cloud.within();
        let (above, below) = (nearest(0.57, 0.54), nearest(0.57, 0.46));
        let (left, disk) = (nearest(0.15, 0.5), nearest(0.9, 0.5));
        // Along the inner circle from one side of the slit to the other; shortest paths on nodes are at most 3 %
        // longer than those in the plane, and turn within a cell of the boundary.
        let inner = 2.0 * (std::f64::consts::PI - (0.04_f64 / 0.17).atan()) * 0.17;
        let around = within[(above, below)];
        assert!((around / inner - 1.0).abs() < 0.07, "{around} {inner}");
        assert!((within[(left, disk)] - 0.75).abs() < 2.0 * grid.spacing());
        for (i, j) in [(above, below), (left, above), (left, disk)] {
            assert!((within[(i, j)] - within[(j, i)]).abs() < 1e-12);
        }
    }
}
