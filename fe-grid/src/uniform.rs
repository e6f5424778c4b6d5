//! Mass and stiffness with constant coefficients, at the speed of memory.
//!
//! On a uniform grid `m M + s L` is a sum of tensor products of the one-dimensional matrices
//!
//! ```text
//! mass h/6 [1 4 1],    stiffness 1/h [-1 2 -1],
//! ```
//!
//! with half the diagonal at the ends. Rows of nodes along `x` that lie at the same distance from
//! an output row have the same weights: they are added first, and what is left is one combination
//! along `x`. Every number is read from memory and written to it once; planes and rows between are
//! found in the caches.
//!
//! At an end of an axis the matrices are half of what they are inside, applied to values that are
//! mirrored there. So all rows are worked on alike, and the rows inside a plane, which lie one
//! after the other in memory, as one long row whose places at the ends are set afterwards.

use crate::linear::LinearOperator;
use crate::operators::MassStiffness;
use crate::{Element, Grid, Lane, LaneKernel, SimdLevel};
use rayon::prelude::*;

/// Numbers that are worked on at a time, at least one row: they and their neighbours stay in the
/// innermost cache.
const STRETCH: usize = 1024;
/// Rows of a two-dimensional grid that one task works on; in three dimensions it is a plane.
const TASK_ROWS: usize = 16;
/// Fewer nodes are not worth waking a second thread for.
const PARALLEL_NODES: usize = 16384;

/// `m M + s L` with the mass matrix `M` and the stiffness matrix `L` of multilinear elements.
///
/// The same as the Hessian action of [`MassStiffness`] in an [`Assembly`](crate::Assembly), up to
/// rounding. Data of several components are worked on component by component.
#[derive(Clone, Copy, Debug)]
pub struct UniformOperator<const D: usize> {
    grid: Grid<D>,
    weights: Weights,
    level: SimdLevel,
}

/// Weights of rows by their distance from the output row: itself, neighbours along one axis,
/// neighbours along two.
#[derive(Clone, Copy, Debug)]
struct Weights {
    /// Weights of a node's own place along `x`.
    own: [f64; 3],
    /// Weights of the places beside it.
    beside: [f64; 3],
}

impl Weights {
    fn new<const D: usize>(spacing: f64, coefficients: MassStiffness) -> Self {
        let MassStiffness { mass, stiffness } = coefficients;
        // Entries of the one-dimensional matrices on the diagonal and beside it.
        let m = [2.0 * spacing / 3.0, spacing / 6.0];
        let k = [2.0 / spacing, -1.0 / spacing];
        let mut weights = Self {
            own: [0.0; 3],
            beside: [0.0; 3],
        };
        for distance in 0..D {
            // How many of the other axes (one or two) are crossed diagonally.
            let (y, z) = (usize::from(distance > 0), usize::from(distance > 1));
            let (masses, stiffnesses) = if D == 3 {
                (m[y] * m[z], k[y] * m[z] + m[y] * k[z])
            } else {
                (m[y], k[y])
            };
            // The factors of mass and of stiffness along x.
            let a = mass * masses + stiffness * stiffnesses;
            let b = stiffness * masses;
            weights.own[distance] = a * m[0] + b * k[0];
            weights.beside[distance] = a * m[1] + b * k[1];
        }
        weights
    }

    fn scaled(self, factor: f64) -> Self {
        Self {
            own: self.own.map(|w| w * factor),
            beside: self.beside.map(|w| w * factor),
        }
    }
}

impl<const D: usize> UniformOperator<D> {
    /// The operator with these coefficients on a grid.
    pub fn new(grid: Grid<D>, coefficients: MassStiffness) -> Self {
        const { assert!(D == 2 || D == 3) };
        Self {
            grid,
            weights: Weights::new::<D>(grid.spacing(), coefficients),
            level: SimdLevel::active(),
        }
    }

    /// The same on another instruction set.
    pub fn with_simd_level(mut self, level: SimdLevel) -> Self {
        self.level = level;
        self
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// `y = A x` in either precision, component by component.
    ///
    /// # Panics
    /// If the lengths differ or are no multiple of the number of nodes.
    pub fn product_into<T: Element>(&self, x: &[T], y: &mut [T]) {
        let n = self.grid.n_nodes();
        assert_eq!(x.len(), y.len());
        assert_eq!(x.len() % n, 0, "whole components only");
        for (x, y) in x.chunks_exact(n).zip(y.chunks_exact_mut(n)) {
            self.component_into(x, y);
        }
    }

    fn component_into<T: Element>(&self, x: &[T], y: &mut [T]) {
        let nodes = self.grid.nodes_per_axis();
        let (width, height) = (nodes[0], nodes[1]);
        let task_rows = if D == 3 { height } else { TASK_ROWS };
        let room = || vec![T::default(); work_space(width)];
        let work = |room: &mut Vec<T>, (task, out): (usize, &mut [T])| {
            let (first_row, plane, weights) = if D == 3 {
                let ends = usize::from(task == 0 || task + 1 == nodes[D - 1]);
                (0, task, self.weights.scaled(0.5f64.powi(ends as i32)))
            } else {
                (task * task_rows, 0, self.weights)
            };
            let size = width * height;
            let plane_at = |k: usize| &x[k * size..(k + 1) * size];
            let beyond = match D {
                3 => mirrored(plane, nodes[D - 1]).map(plane_at),
                _ => [plane_at(0); 2],
            };
            let kernel = PlaneKernel::<T, D> {
                own: plane_at(plane),
                beyond,
                size: [width, height],
                first_row,
                weights,
                room,
                out,
            };
            T::dispatch(self.level, kernel);
        };
        let chunk = task_rows * width;
        if self.grid.n_nodes() < PARALLEL_NODES {
            let mut room = room();
            for task in y.chunks_mut(chunk).enumerate() {
                work(&mut room, task);
            }
        } else {
            y.par_chunks_mut(chunk)
                .enumerate()
                .for_each_init(room, work);
        }
    }
}

impl<const D: usize> LinearOperator for UniformOperator<D> {
    fn dim(&self) -> usize {
        self.grid.n_nodes()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        self.product_into(x, y);
    }
}

/// The neighbours of a place among `n`; at an end the one inside, twice.
fn mirrored(i: usize, n: usize) -> [usize; 2] {
    let (below, above) = (i.checked_sub(1), Some(i + 1).filter(|&i| i < n));
    // One of the two exists: an axis has two nodes at least.
    [below.or(above).unwrap_or(i), above.or(below).unwrap_or(i)]
}

/// Rows in a stretch.
fn stretch_rows(width: usize) -> usize {
    (STRETCH / width).max(1)
}

/// Numbers of work space: a stretch between two zeros, and the ends of its rows.
fn work_space(width: usize) -> usize {
    let rows = stretch_rows(width);
    rows * width + 2 + 2 * rows
}

/// Some rows of a plane of the product.
struct PlaneKernel<'a, T, const D: usize> {
    /// The plane of `x` that the rows lie in.
    own: &'a [T],
    /// The planes before and behind it, not read in two dimensions.
    beyond: [&'a [T]; 2],
    /// Nodes along `x` and `y`.
    size: [usize; 2],
    first_row: usize,
    weights: Weights,
    room: &'a mut [T],
    out: &'a mut [T],
}

impl<'a, T: Element, const D: usize> LaneKernel<T> for PlaneKernel<'a, T, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) {
        let [width, height] = self.size;
        let most = stretch_rows(width);
        let (beside, ends) = self.room.split_at_mut(most * width + 2);
        let end = self.first_row + self.out.len() / width;
        let mut out = self.out;
        let mut row = self.first_row;
        while row < end {
            // The outermost rows stand for themselves: their neighbours are mirrored.
            let outermost = row == 0 || row + 1 == height;
            let rows = if outermost {
                1
            } else {
                most.min(end - row).min(height - 1 - row)
            };
            let length = rows * width;
            let weights = self.weights.scaled(if outermost { 0.5 } else { 1.0 });
            let [below, above] = mirrored(row, height);
            let places = [row, below, above].map(|row| row * width);
            let parts = |plane: &'a [T]| places.map(|p| &plane[p..p + length]);
            let (stretch, rest) = out.split_at_mut(length);
            let beside = &mut beside[..length + 2];
            beside[0] = T::default();
            beside[length + 1] = T::default();
            let inner = &mut beside[1..=length];
            let own = parts(self.own);
            let beyond = self.beyond.map(parts);
            combine_rows::<L, T, D>(own, beyond, weights, stretch, inner);
            combine_places::<L, T>(width, beside, &mut ends[..2 * rows], stretch);
            out = rest;
            row += rows;
        }
    }
}

/// Rows `[itself, below, above]` of the own plane and of those beyond it, added with the weights
/// of a node's own place and of the places beside it.
#[inline(always)]
fn combine_rows<L: Lane<Element = T>, T: Element, const D: usize>(
    own: [&[T]; 3],
    beyond: [[&[T]; 3]; 2],
    weights: Weights,
    own_sums: &mut [T],
    beside_sums: &mut [T],
) {
    let length = own_sums.len();
    let own = own.map(|row| &row[..length]);
    let beyond = beyond.map(|rows| rows.map(|row| &row[..length]));
    let beside_sums = &mut beside_sums[..length];
    let own_weights = weights.own.map(L::splat);
    let beside_weights = weights.beside.map(L::splat);
    let mut block = |from: usize, to: usize| {
        let load = |row: &[T]| L::load(&row[from..to]);
        let itself = load(own[0]);
        let mut near = load(own[1]) + load(own[2]);
        let mut far = L::zero();
        if D == 3 {
            let [before, behind] = beyond;
            near += load(before[0]) + load(behind[0]);
            far = (load(before[1]) + load(before[2])) + (load(behind[1]) + load(behind[2]));
        }
        let sum = |w: [L; 3]| {
            let sum = near.mul_add(w[1], itself * w[0]);
            if D == 3 { far.mul_add(w[2], sum) } else { sum }
        };
        sum(own_weights).store(&mut own_sums[from..to]);
        sum(beside_weights).store(&mut beside_sums[from..to]);
    };
    let mut i = 0;
    while i + L::COUNT <= length {
        block(i, i + L::COUNT);
        i += L::COUNT;
    }
    if i < length {
        block(i, length);
    }
}

/// Adds the places beside every place to it. `out` holds the sums for the own places, `beside`
/// those for the places beside, between two zeros; `ends` is work space for two numbers a row.
#[inline(always)]
fn combine_places<L: Lane<Element = T>, T: Element>(
    width: usize,
    beside: &[T],
    ends: &mut [T],
    out: &mut [T],
) {
    let half = T::from_f64(0.5);
    let last = width - 1;
    for (r, end) in ends.chunks_exact_mut(2).enumerate() {
        // `beside` is shifted by one.
        let first = r * width;
        end[0] = half * out[first] + beside[first + 2];
        end[1] = half * out[first + last] + beside[first + last];
    }
    let length = out.len();
    let (before, behind) = (&beside[..length], &beside[2..length + 2]);
    let mut block = |from: usize, to: usize| {
        let sum = L::load(&out[from..to]) + L::load(&before[from..to]);
        (sum + L::load(&behind[from..to])).store(&mut out[from..to]);
    };
    let mut i = 0;
    while i + L::COUNT <= length {
        block(i, i + L::COUNT);
        i += L::COUNT;
    }
    if i < length {
        block(i, length);
    }
    for (row, end) in out.chunks_exact_mut(width).zip(ends.chunks_exact(2)) {
        row[0] = end[0];
        row[last] = end[1];
    }
}
