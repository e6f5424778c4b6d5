//! Mass and stiffness operators with constant coefficients, limited by memory bandwidth.
//!
//! On a uniform grid `m M + s L` is a sum of tensor products of the one-dimensional matrices
//!
//! ```text
//! mass h/6 [1 4 1],    stiffness 1/h [-1 2 -1],
//! ```
//!
//! with half the diagonal at the ends. Rows of nodes along `x` at the same distance from an output
//! row have the same weights: they are added first, and their sums are combined along `x`. Every
//! value is read from memory and written to memory once; neighbouring planes and rows are in the
//! caches.
//!
//! At an end of an axis the matrices are half of the inner ones, applied to values that are
//! mirrored there. All rows can therefore be processed in the same way, and the inner rows of a
//! plane, which are contiguous in memory, as one long row; the values at the ends of rows are
//! corrected afterwards.

use crate::compiled_once;
use crate::engine::kernel::CACHE_LINE;
use crate::engine::rows::block_starts;
use crate::grid::Grid;
use crate::lane::{Element, Lane, LaneKernel, MAX_LANES};
use crate::linear::LinearOperator;
use crate::operators::MassStiffness;
use crate::parallel;
use crate::pool::Pool;
use crate::simd_level::SimdLevel;
use std::ops::Range;

/// Number of values processed at a time, at least one row: they and their neighbours fit the
/// first-level cache.
const STRETCH: usize = 520;
/// Bytes of the part of a plane that is processed through all planes of a task: it and its
/// counterparts in the neighbouring planes and in the product fit the second-level cache.
const BLOCK: usize = 1 << 18;
/// Number of planes per task.
const TASK_PLANES: usize = 8;
/// Number of rows per task in two dimensions.
const TASK_ROWS: usize = 16;
/// Grids with fewer nodes are processed by one thread.
const PARALLEL_NODES: usize = 16384;

/// `m M + s L` with the mass matrix `M` and the stiffness matrix `L` of multilinear elements.
///
/// Equal to the Hessian action of [`MassStiffness`] in an [`Assembly`](crate::Assembly) up to
/// rounding. Fields of several components are processed component by component.
#[derive(Clone, Copy, Debug)]
pub struct UniformOperator<const D: usize> {
    grid: Grid<D>,
    weights: Weights,
    level: SimdLevel,
}

/// Weights of rows by their distance from the output row: the row itself, its neighbours along one
/// axis, and those along two axes.
#[derive(Clone, Copy, Debug)]
struct Weights {
    /// Weights of the node with the same index along `x`.
    own: [f64; 3],
    /// Weights of its two neighbours along `x`.
    beside: [f64; 3],
}

impl Weights {
    fn new<const D: usize>(spacing: f64, coefficients: MassStiffness) -> Self {
        let MassStiffness { mass, stiffness } = coefficients;
        // Entries of the one-dimensional matrices on the diagonal and beside it.
        let beside = mutant!(spacing / 6.0, UniformMass => spacing / 5.0);
        let m = [2.0 * spacing / 3.0, beside];
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

    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        Self {
            own: self.own.map(|w| w * factor),
            beside: self.beside.map(|w| w * factor),
        }
    }
}

impl<const D: usize> UniformOperator<D> {
    /// Creates the operator with these coefficients on a grid.
    pub fn new(grid: Grid<D>, coefficients: MassStiffness) -> Self {
        const { assert!(D == 2 || D == 3) };
        Self {
            grid,
            weights: Weights::new::<D>(grid.spacing(), coefficients),
            level: SimdLevel::active(),
        }
    }

    /// Selects another instruction set.
    pub fn with_simd_level(mut self, level: SimdLevel) -> Self {
        self.level = level;
        self
    }

    /// Returns the grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Computes `y = A x` in either precision, component by component.
    ///
    /// # Panics
    /// If the lengths differ or are not a multiple of the number of nodes.
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
        let [width, height] = [nodes[0], nodes[1]];
        let chunk = width
            * if D == 3 {
                TASK_PLANES * height
            } else {
                TASK_ROWS
            };
        let rooms = Pool::new();
        let room = || vec![T::default(); work_space(width)];
        let work = |task: usize, room: &mut Vec<T>, out: &mut [T]| {
            let kernel = TaskKernel::<T, D> {
                nodes: Nodes {
                    x,
                    size: [width, height, if D == 3 { nodes[D - 1] } else { 1 }],
                },
                weights: self.weights,
                first_row: task * (chunk / width),
                room,
                out,
            };
            T::dispatch(self.level, kernel);
        };
        let n_nodes = self.grid.n_nodes();
        let min_len = if n_nodes < PARALLEL_NODES { n_nodes } else { 1 };
        parallel::for_each_chunk(y, chunk, min_len, &|task, out| {
            rooms.with(room, |room| work(task, room, out));
        });
    }
}

impl<const D: usize> LinearOperator for UniformOperator<D> {
    fn dim(&self) -> usize {
        self.grid.n_nodes()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        apply(self, x, y);
    }
}

compiled_once! {
    /// Computes the product in double precision.
    fn apply<'a, D>(
        operator: &'a UniformOperator<D>,
        x: &'a [f64],
        y: &'a mut [f64],
    ) = UniformOperator::product_into;
}

/// Returns the neighbours of an index below `n`; at an end, the inner neighbour twice.
#[inline(always)]
fn mirrored(i: usize, n: usize) -> [usize; 2] {
    let (below, above) = (i.checked_sub(1), Some(i + 1).filter(|&i| i < n));
    // One of the two exists: an axis has two nodes at least.
    [below.or(above).unwrap_or(i), above.or(below).unwrap_or(i)]
}

/// Returns the maximal number of rows of a stretch.
#[inline(always)]
fn stretch_rows(width: usize) -> usize {
    (STRETCH / width).max(1)
}

/// Returns the length of the work space: two stretches, each with zeros before and after it, in
/// whole registers aligned to cache lines.
fn work_space(width: usize) -> usize {
    2 * sums_stride(width) + MAX_LANES
}

#[inline(always)]
fn sums_stride(width: usize) -> usize {
    (stretch_rows(width) * width).next_multiple_of(MAX_LANES) + 2 * MAX_LANES
}

/// The nodal values, as rows along `x`.
struct Nodes<'a, T, const D: usize> {
    x: &'a [T],
    /// Numbers of nodes along `x`, `y` and `z`; one along `z` in two dimensions.
    size: [usize; 3],
}

/// Some planes of the product, or in two dimensions some rows.
struct TaskKernel<'a, T, const D: usize> {
    nodes: Nodes<'a, T, D>,
    weights: Weights,
    /// Index of the first row, counted through all planes.
    first_row: usize,
    room: &'a mut [T],
    out: &'a mut [T],
}

impl<T: Element, const D: usize> LaneKernel<T> for TaskKernel<'_, T, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) {
        let [width, height, depth] = self.nodes.size;
        let aligned = self.room.as_ptr().align_offset(CACHE_LINE);
        let room = self.room.get_mut(aligned..).unwrap_or_default();
        let (own_sums, beside_sums) = room.split_at_mut(sums_stride(width));
        let end_row = self.first_row + self.out.len() / width;
        let (rows, planes) = if D == 3 {
            (0..height, self.first_row / height..end_row / height)
        } else {
            (self.first_row..end_row, 0..1)
        };
        let at_once = (BLOCK / (width * size_of::<T>())).max(1);
        for block in rows.clone().step_by(at_once) {
            let block = block..rows.end.min(block + at_once);
            for plane in planes.clone() {
                let mut row = block.start;
                while row < block.end {
                    let count = stretch(row, block.end, height, width);
                    // Outermost rows and planes have half of the weights.
                    let ends = u8::from(row == 0 || row + 1 == height)
                        + u8::from(D == 3 && (plane == 0 || plane + 1 == depth));
                    let weights = self.weights.scaled([1.0, 0.5, 0.25][usize::from(ends)]);
                    let length = count * width;
                    beside_sums[MAX_LANES - 1] = T::default();
                    beside_sums[MAX_LANES + length] = T::default();
                    let beside = &mut beside_sums[MAX_LANES..MAX_LANES + length];
                    let own = &mut own_sums[..length];
                    self.nodes.add_rows::<L>(row, plane, weights, own, beside);
                    let start = (plane * height + row - self.first_row) * width;
                    let out = &mut self.out[start..start + length];
                    add_places::<L, T>(width, own, &beside_sums[MAX_LANES - 1..], out);
                    row += count;
                }
            }
        }
    }
}

/// Returns the number of rows from `row` on that are processed at a time. The outermost rows, whose
/// neighbours are mirrored, are processed singly.
#[inline(always)]
fn stretch(row: usize, end: usize, height: usize, width: usize) -> usize {
    if row == 0 || row + 1 == height {
        1
    } else {
        stretch_rows(width).min(end - row).min(height - 1 - row)
    }
}

impl<T: Element, const D: usize> Nodes<'_, T, D> {
    /// Adds the rows around every row of a stretch, which begins at row `first` of a plane, with
    /// the weights of a node's own index along `x` and of its neighbours.
    ///
    /// A few columns at a time are processed through all rows, so that the contributions of a row
    /// to the next two outputs are still in registers.
    #[inline(always)]
    fn add_rows<L: Lane<Element = T>>(
        &self,
        first: usize,
        plane: usize,
        weights: Weights,
        own_sums: &mut [T],
        beside_sums: &mut [T],
    ) {
        let [width, height, depth] = self.size;
        let count = own_sums.len() / width;
        let own_weights = weights.own.map(L::splat);
        let beside_weights = weights.beside.map(L::splat);
        // Only a stretch of one row has its neighbours mirrored.
        let below = mirrored(first, height)[0];
        let above = mirrored(first + count - 1, height)[1];
        let area = width * height;
        let beyond = if D == 3 {
            mirrored(plane, depth)
        } else {
            [0; 2]
        };
        let planes = [plane, beyond[0], beyond[1]].map(|p| &self.x[p * area..(p + 1) * area]);
        for x in block_starts::<L>(width) {
            let columns = |row: usize| row * width + x..row * width + width.min(x + L::COUNT);
            let mut before = add_planes::<L, T, D>(&planes, columns(below));
            let mut here = add_planes::<L, T, D>(&planes, columns(first));
            for r in 0..count {
                let next = if r + 1 < count { first + r + 1 } else { above };
                let behind = add_planes::<L, T, D>(&planes, columns(next));
                let near = (before[0] + behind[0]) + here[1];
                let sums = [here[0], near, before[1] + behind[1]];
                weigh::<L, D>(sums, own_weights).store(&mut own_sums[columns(r)]);
                weigh::<L, D>(sums, beside_weights).store(&mut beside_sums[columns(r)]);
                before = here;
                here = behind;
            }
        }
    }
}

/// Returns some columns of a row: those of its own plane, and the sum of those of the neighbouring
/// planes.
#[inline(always)]
fn add_planes<L: Lane<Element = T>, T: Element, const D: usize>(
    [own, before, behind]: &[&[T]; 3],
    places: Range<usize>,
) -> [L; 2] {
    let own = L::load(&own[places.clone()]);
    if D == 3 {
        [
            own,
            L::load(&before[places.clone()]) + L::load(&behind[places]),
        ]
    } else {
        [own, L::zero()]
    }
}

#[inline(always)]
fn weigh<L: Lane, const D: usize>([itself, near, far]: [L; 3], weights: [L; 3]) -> L {
    let sum = near.mul_add(weights[1], itself * weights[0]);
    if D == 3 {
        far.mul_add(weights[2], sum)
    } else {
        sum
    }
}

/// Adds the sums for a node's own index and for its neighbours along `x`. `beside` begins one entry
/// before the first node.
#[inline(always)]
fn add_places<L: Lane<Element = T>, T: Element>(
    width: usize,
    own: &[T],
    beside: &[T],
    out: &mut [T],
) {
    let length = out.len();
    let (before, behind) = (&beside[..length], &beside[2..length + 2]);
    let own = &own[..length];
    let rows = own
        .chunks(L::COUNT)
        .zip(before.chunks(L::COUNT))
        .zip(behind.chunks(L::COUNT));
    for (out, ((own, before), behind)) in out.chunks_mut(L::COUNT).zip(rows) {
        (L::load(own) + L::load(before) + L::load(behind)).store(out);
    }
    let half = T::from_f64(0.5);
    let last = width - 1;
    for (r, row) in out.chunks_exact_mut(width).enumerate() {
        let first = r * width;
        row[0] = half * own[first] + behind[first];
        row[last] = half * own[first + last] + before[first + last];
    }
}
