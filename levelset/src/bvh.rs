//! A tree of bounding boxes over the simplices of a contour.
//!
//! The boxes stand along the mean normal of what they hold. Around a piece of a smooth boundary
//! such a box is thin, and from afar the search rules out all but the few pieces that the point
//! really looks at; boxes along the axes are as thick as wide, and were slower by a factor of
//! four on a 3D blob.

use crate::closest::{Closest, closest};
use crate::vector::{add_scaled, area_normal, dot, norm, sub};

/// Simplices in a leaf: a balance between box tests and simplex tests, by timing.
const LEAF_SIZE: usize = 4;
/// Deepest tree: halving splits reach a leaf of 2^32 simplices long before.
const MAX_DEPTH: usize = 48;

#[derive(Clone, Debug)]
struct Node<const D: usize> {
    bounds: OrientedBox<D>,
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
        let index = self.nodes.len();
        self.nodes.push(Node {
            bounds: OrientedBox::around(simplices, order),
            first: first as u32,
            count: order.len() as u32,
        });
        if order.len() <= LEAF_SIZE {
            return;
        }
        let (low, high) = bounds(order.iter().flat_map(|&i| &simplices[i as usize]), &|p| *p);
        let axis = longest(&sub(&high, &low));
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
        self.nodes[node as usize].bounds.distance_squared(point)
    }
}

/// A box with its own axes.
#[derive(Clone, Debug)]
struct OrientedBox<const D: usize> {
    centre: [f64; D],
    axes: [[f64; D]; D],
    half: [f64; D],
}

impl<const D: usize> OrientedBox<D> {
    /// A box around the given simplices, one axis along their mean normal.
    fn around(simplices: &[[[f64; D]; D]], order: &[u32]) -> Self {
        let corners = || order.iter().flat_map(|&i| &simplices[i as usize]);
        let (mut normal, mut size) = ([0.0; D], 0.0);
        for &i in order {
            let n = area_normal(&simplices[i as usize]);
            normal = add_scaled(&normal, 1.0, &n);
            size += norm(&n);
        }
        let axes = if norm(&normal) > 0.1 * size {
            let (low, high) = bounds(corners(), &|p| *p);
            frame(&normal, longest(&sub(&high, &low)))
        } else {
            std::array::from_fn(unit)
        };
        let (low, high) = bounds(corners(), &|p| axes.map(|a| dot(&a, p)));
        let mut centre = [0.0; D];
        for k in 0..D {
            centre = add_scaled(&centre, 0.5 * (low[k] + high[k]), &axes[k]);
        }
        Self {
            centre,
            axes,
            half: std::array::from_fn(|k| 0.5 * (high[k] - low[k])),
        }
    }

    #[inline]
    fn distance_squared(&self, point: &[f64; D]) -> f64 {
        let offset = sub(point, &self.centre);
        let mut sum = 0.0;
        for k in 0..D {
            let gap = (dot(&self.axes[k], &offset).abs() - self.half[k]).max(0.0);
            sum += gap * gap;
        }
        sum
    }
}

/// An orthonormal frame: the direction of `normal` first, then directions across it, as close
/// to the given axis as may be.
fn frame<const D: usize>(normal: &[f64; D], axis: usize) -> [[f64; D]; D] {
    let mut axes = [[0.0; D]; D];
    let length = norm(normal);
    axes[0] = normal.map(|x| x / length);
    let mut filled = 1;
    for shift in 0..D {
        let mut across: [f64; D] = unit((axis + shift) % D);
        for done in &axes[..filled] {
            across = add_scaled(&across, -dot(&across, done), done);
        }
        let length = norm(&across);
        // At most one of the axes can lie this close to the ones before it.
        if filled < D && length > 0.3 {
            axes[filled] = across.map(|x| x / length);
            filled += 1;
        }
    }
    if filled < D {
        return std::array::from_fn(unit);
    }
    axes
}

fn unit<const D: usize>(axis: usize) -> [f64; D] {
    std::array::from_fn(|k| f64::from(u8::from(k == axis)))
}

fn longest<const D: usize>(sides: &[f64; D]) -> usize {
    (0..D)
        .max_by(|&a, &b| sides[a].total_cmp(&sides[b]))
        .unwrap_or(0)
}

/// Lowest and highest coordinates of mapped points.
fn bounds<'a, const D: usize>(
    points: impl Iterator<Item = &'a [f64; D]>,
    map: &dyn Fn(&[f64; D]) -> [f64; D],
) -> ([f64; D], [f64; D]) {
    let mut low = [f64::INFINITY; D];
    let mut high = [f64::NEG_INFINITY; D];
    for p in points {
        let p = map(p);
        for k in 0..D {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    (low, high)
}
