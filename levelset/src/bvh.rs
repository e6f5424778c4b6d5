//! A tree of bounding boxes over the simplices of a contour.
//!
//! The boxes are aligned with the mean normal of their contents. Around a piece of a smooth
//! boundary such a box is thin, and a distant query visits only the few pieces close to the foot of
//! the point; axis-aligned boxes are as thick as wide, and were slower by a factor of four on a 3D
//! blob.

use fe_grid::Lane;

use crate::closest::Simplex;
use crate::contour::bounds;
use crate::vector::{add_scaled, area_normal, dot, norm, sub};

/// Number of simplices in a leaf: a balance between box tests and simplex tests, determined by
/// timing.
const LEAF_SIZE: usize = 4;
/// Boxes are enlarged by this fraction of the largest coordinate, so that rounding errors never
/// make a box farther than its contents.
const MARGIN: f64 = 64.0 * f64::EPSILON;

#[derive(Clone, Debug)]
pub(crate) struct Node<const D: usize> {
    pub(crate) bounds: OrientedBox<D>,
    /// First simplex of a leaf; the right child of an inner node, whose left child follows it.
    pub(crate) first: u32,
    /// Number of simplices of a leaf, zero in an inner node.
    pub(crate) count: u32,
}

/// The tree. Simplices are stored in the order of the leaves.
#[derive(Clone, Debug)]
pub(crate) struct Bvh<const D: usize> {
    nodes: Vec<Node<D>>,
    corners: Vec<[[f64; D]; D]>,
    simplices: Vec<Simplex<D>>,
    /// Index in the contour of each stored simplex.
    origin: Vec<u32>,
}

impl<const D: usize> Bvh<D> {
    /// Builds the tree over a non-empty list of simplices.
    pub(crate) fn new(simplices: &[[[f64; D]; D]]) -> Self {
        let mut order: Vec<u32> = (0..simplices.len() as u32).collect();
        let mut tree = Self {
            nodes: Vec::with_capacity(simplices.len()),
            corners: Vec::new(),
            simplices: Vec::new(),
            origin: Vec::new(),
        };
        let coordinates = simplices.iter().flatten().flatten();
        let largest = coordinates.fold(0.0, |m: f64, x| m.max(x.abs()));
        tree.split(simplices, &mut order, 0, MARGIN * largest);
        tree.corners = order.iter().map(|&i| simplices[i as usize]).collect();
        tree.simplices = tree.corners.iter().map(Simplex::new).collect();
        tree.origin = order;
        tree
    }

    fn split(&mut self, simplices: &[[[f64; D]; D]], order: &mut [u32], first: usize, margin: f64) {
        let index = self.nodes.len();
        self.nodes.push(Node {
            bounds: OrientedBox::around(simplices, order, margin),
            first: first as u32,
            count: order.len() as u32,
        });
        if order.len() <= LEAF_SIZE {
            return;
        }
        let [low, high] = bounds(order.iter().flat_map(|&i| simplices[i as usize]));
        let axis = longest(&sub(&high, &low));
        let centre = |i: u32| -> f64 { simplices[i as usize].iter().map(|c| c[axis]).sum() };
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |&a, &b| {
            centre(a).total_cmp(&centre(b)).then(a.cmp(&b))
        });
        let (left, right) = order.split_at_mut(middle);
        self.split(simplices, left, first, margin);
        self.nodes[index].first = self.nodes.len() as u32;
        self.nodes[index].count = 0;
        self.split(simplices, right, first + middle, margin);
    }

    /// Returns the corners of a stored simplex.
    pub(crate) fn corners(&self, stored: usize) -> &[[f64; D]; D] {
        &self.corners[stored]
    }

    /// Returns all stored simplices.
    pub(crate) fn all_corners(&self) -> &[[[f64; D]; D]] {
        &self.corners
    }

    /// Returns the index in the contour of a stored simplex.
    pub(crate) fn origin(&self, stored: usize) -> usize {
        self.origin[stored] as usize
    }

    /// Returns a stored simplex, prepared for distance computations.
    #[inline(always)]
    pub(crate) fn simplex(&self, stored: usize) -> &Simplex<D> {
        &self.simplices[stored]
    }

    /// Returns a node; the first is the root.
    #[inline(always)]
    pub(crate) fn node(&self, index: u32) -> &Node<D> {
        &self.nodes[index as usize]
    }
}

/// An oriented bounding box.
#[derive(Clone, Debug)]
pub(crate) struct OrientedBox<const D: usize> {
    axes: [[f64; D]; D],
    /// Centre of the box, as coordinates along its axes.
    centre: [f64; D],
    half: [f64; D],
}

impl<const D: usize> OrientedBox<D> {
    /// Computes a box around the given simplices, with one axis along their mean normal.
    fn around(simplices: &[[[f64; D]; D]], order: &[u32], margin: f64) -> Self {
        let corners = || order.iter().flat_map(|&i| simplices[i as usize]);
        let (mut normal, mut size) = ([0.0; D], 0.0);
        for &i in order {
            let n = area_normal(&simplices[i as usize]);
            normal = add_scaled(&normal, 1.0, &n);
            size += norm(&n);
        }
        let axes = if norm(&normal) > 0.1 * size {
            let [low, high] = bounds(corners());
            frame(&normal, longest(&sub(&high, &low)))
        } else {
            std::array::from_fn(unit)
        };
        let [low, high] = bounds(corners().map(|p| axes.map(|a| dot(&a, &p))));
        Self {
            axes,
            centre: std::array::from_fn(|k| 0.5 * (low[k] + high[k])),
            half: std::array::from_fn(|k| 0.5 * (high[k] - low[k]) + margin),
        }
    }

    /// Computes squared distances of points from the box; zero inside.
    #[inline(always)]
    pub(crate) fn distance_squared<L: Lane<Element = f64>>(&self, point: &[L; D]) -> L {
        let mut sum = L::zero();
        for k in 0..D {
            let mut along = L::splat(-self.centre[k]);
            for j in 0..D {
                along = L::splat(self.axes[k][j]).mul_add(point[j], along);
            }
            let gap = (along.abs() - L::splat(self.half[k])).max(L::zero());
            sum = gap.mul_add(gap, sum);
        }
        sum
    }
}

/// Computes an orthonormal frame: the direction of `normal` first, then orthogonal directions, as
/// close to the given axis as possible.
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
