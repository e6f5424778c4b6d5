//! A tree of bounding boxes over the simplices of a contour.

use crate::closest::{Closest, closest};

/// Simplices in a leaf: a balance between box tests and simplex tests, by timing.
const LEAF_SIZE: usize = 4;
/// Deepest tree: halving splits reach a leaf of 2^32 simplices long before.
const MAX_DEPTH: usize = 48;

#[derive(Clone, Debug)]
struct Node<const D: usize> {
    low: [f64; D],
    high: [f64; D],
    /// First simplex of a leaf; the right child of an inner node, whose left child follows it.
    first: u32,
    /// Simplices of a leaf, zero in an inner node.
    count: u32,
}

/// The tree. Simplices are stored in the order of the leaves.
#[derive(Clone, Debug)]
pub(crate) struct Bvh<const D: usize> {
    nodes: Vec<Node<D>>,
    corners: Vec<[[f64; D]; D]>,
    /// Position in the contour of each stored simplex.
    origin: Vec<u32>,
}

impl<const D: usize> Bvh<D> {
    /// The tree over a non-empty list of simplices.
    pub(crate) fn new(simplices: &[[[f64; D]; D]]) -> Self {
        let mut order: Vec<u32> = (0..simplices.len() as u32).collect();
        let mut tree = Self {
            nodes: Vec::with_capacity(simplices.len()),
            corners: Vec::new(),
            origin: Vec::new(),
        };
        tree.split(simplices, &mut order, 0);
        tree.corners = order.iter().map(|&i| simplices[i as usize]).collect();
        tree.origin = order;
        tree
    }

    fn split(&mut self, simplices: &[[[f64; D]; D]], order: &mut [u32], first: usize) {
        let (low, high) = bounds(order.iter().flat_map(|&i| &simplices[i as usize]));
        let index = self.nodes.len();
        self.nodes.push(Node {
            low,
            high,
            first: first as u32,
            count: order.len() as u32,
        });
        if order.len() <= LEAF_SIZE {
            return;
        }
        let axis = (0..D)
            .max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b])))
            .unwrap_or(0);
        let centre = |i: u32| -> f64 { simplices[i as usize].iter().map(|c| c[axis]).sum() };
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |&a, &b| {
            centre(a).total_cmp(&centre(b)).then(a.cmp(&b))
        });
        let (left, right) = order.split_at_mut(middle);
        self.split(simplices, left, first);
        self.nodes[index].first = self.nodes.len() as u32;
        self.nodes[index].count = 0;
        self.split(simplices, right, first + middle);
    }

    /// Corners of a stored simplex.
    pub(crate) fn corners(&self, stored: usize) -> &[[f64; D]; D] {
        &self.corners[stored]
    }

    /// All stored simplices.
    pub(crate) fn all_corners(&self) -> &[[[f64; D]; D]] {
        &self.corners
    }

    /// Position in the contour of a stored simplex.
    pub(crate) fn origin(&self, stored: usize) -> usize {
        self.origin[stored] as usize
    }

    /// The stored simplex nearest to a point. `guess` is a stored simplex to start from: one
    /// that lies near makes the search short; it does not change the distance found.
    pub(crate) fn nearest(&self, point: &[f64; D], guess: usize) -> (usize, Closest<D>) {
        let mut best = guess;
        let mut found = closest(&self.corners[guess], point);
        let mut stack = [(0u32, 0.0f64); MAX_DEPTH];
        stack[0] = (0, self.box_distance(0, point));
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (index, bound) = stack[height];
            if bound >= found.distance_squared {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                let first = node.first as usize;
                for stored in first..first + node.count as usize {
                    let candidate = closest(&self.corners[stored], point);
                    if candidate.distance_squared < found.distance_squared {
                        found = candidate;
                        best = stored;
                    }
                }
                continue;
            }
            let left = (index + 1, self.box_distance(index + 1, point));
            let right = (node.first, self.box_distance(node.first, point));
            let (near, far) = if left.1 <= right.1 {
                (left, right)
            } else {
                (right, left)
            };
            stack[height] = far;
            stack[height + 1] = near;
            height += 2;
        }
        (best, found)
    }

    #[inline]
    fn box_distance(&self, node: u32, point: &[f64; D]) -> f64 {
        let node = &self.nodes[node as usize];
        let mut sum = 0.0;
        for k in 0..D {
            let gap = (node.low[k] - point[k])
                .max(point[k] - node.high[k])
                .max(0.0);
            sum += gap * gap;
        }
        sum
    }
}

fn bounds<'a, const D: usize>(points: impl Iterator<Item = &'a [f64; D]>) -> ([f64; D], [f64; D]) {
    let mut low = [f64::INFINITY; D];
    let mut high = [f64::NEG_INFINITY; D];
    for p in points {
        for k in 0..D {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    (low, high)
}
