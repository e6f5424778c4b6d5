//! Sums over deformed quadrature points of products of shape functions: the adjoint of a
//! composition with respect to the composed field, and the normal equations for that field.
//!
//! For sources `(u_i, c_i)` and a [`PointWeights`] rule that gives two numbers `a, b` at every
//! quadrature point, [`normal_equations`] assembles
//!
//! ```text
//! A = sum_i sum_q w a N(Phi_i(x_q)) N(Phi_i(x_q))^T,    r = sum_i sum_q w b N(Phi_i(x_q)),
//! ```
//!
//! with `Phi_i(x) = x + u_i(x)` and `N(y)` the vector of all shape functions at `y`. In a cell
//! the products `N N^T` span no more than `3^D` functions, the tensor products of `(1-s)^2`,
//! `s(1-s)`, `s^2`: a point adds to `3^D` moments of its cell, and moments become matrix entries
//! once all points are in.
//!
//! Every slab of cells belongs to one task, which looks through the sources for points that
//! fall into it; a cell receives its points in the order of the sources, whatever the threads.

use crate::composition::locate_lanes;
use crate::engine::block::{Block, RowData};
use crate::engine::element::MAX_CORNERS;
use crate::engine::kernel::CACHE_LINE;
use crate::engine::rows::{Row, block_starts, first_node, rows_of_layer};
use crate::engine::slabs::{Slab, over_slabs};
use crate::engine::{Data, Point, Reads};
use crate::pool::Pool;
use crate::stencil::{SymmetricStencil, half_offsets};
use crate::{Element, Grid, Lane, LaneKernel, SimdLevel};
use rayon::prelude::*;

/// Below this number of cells everything stays on one thread.
const PARALLEL_CELLS: usize = 1024;
/// `3^D` moments and `2^D` linear moments, at most.
const MAX_PRODUCTS: usize = 9;

/// The two numbers that a quadrature point scatters.
pub trait PointWeights<const D: usize>: Reads {
    /// `(a, b)`: the weight of `N N^T` and of `N`. `point.value` is the displacement,
    /// `deformed` the deformed position.
    fn weights<L: Lane>(&self, point: &Point<L, D, D>, deformed: &[L; D]) -> (L, L);
}

/// One deformation with the coefficient fields that go with it.
#[derive(Clone, Copy)]
pub struct Source<'a, T> {
    /// Displacement, component by component.
    pub displacement: &'a [T],
    /// Nodal coefficient fields.
    pub coefficients: &'a [&'a [T]],
}

/// What is added to the matrix and to the right-hand side besides the scattered points: the
/// element matrix of a constant operator and a constant load.
#[derive(Clone, Copy, Default)]
pub struct Background {
    /// Coefficient of the mass matrix `M`.
    pub mass: f64,
    /// Coefficient of the stiffness matrix `L`.
    pub stiffness: f64,
    /// Constant density of the load: `load * M 1` is added to the right-hand side.
    pub load: f64,
}

/// Assembles `A + mass M + stiffness L` and `r + load M 1`.
///
/// # Panics
/// If a source does not fit the grid.
pub fn normal_equations<T: Element, P: PointWeights<D>, const D: usize>(
    grid: &Grid<D>,
    rule: &P,
    sources: &[Source<'_, T>],
    background: Background,
) -> (SymmetricStencil<D>, Vec<f64>) {
    let mut equations = NormalEquations::new(*grid);
    equations.assemble(rule, sources, background);
    (equations.matrix, equations.rhs)
}

/// Normal equations with the memory to assemble them again and again.
#[derive(Debug)]
pub struct NormalEquations<const D: usize> {
    matrix: SymmetricStencil<D>,
    rhs: Vec<f64>,
    moments: Pool<Vec<f64>>,
}

impl<const D: usize> NormalEquations<D> {
    /// Empty equations: zero.
    pub fn new(grid: Grid<D>) -> Self {
        let n = grid.n_nodes();
        let half = half_offsets::<D>().len();
        // While they are assembled, the right-hand side lies behind the matrix.
        let mut coupling = vec![0.0; (half + 1) * n];
        coupling.truncate(half * n);
        Self {
            matrix: SymmetricStencil::from_parts(grid, coupling),
            rhs: vec![0.0; n],
            moments: Pool::new(),
        }
    }

    /// The matrix.
    pub fn matrix(&self) -> &SymmetricStencil<D> {
        &self.matrix
    }

    /// The right-hand side.
    pub fn rhs(&self) -> &[f64] {
        &self.rhs
    }

    /// Assembles as [`normal_equations`] does.
    ///
    /// # Panics
    /// If a source does not fit the grid.
    pub fn assemble<T: Element, P: PointWeights<D>>(
        &mut self,
        rule: &P,
        sources: &[Source<'_, T>],
        background: Background,
    ) {
        let grid = *self.matrix.grid();
        let n = grid.n_nodes();
        for source in sources {
            assert_eq!(source.displacement.len(), D * n);
            assert!(source.coefficients.len() >= P::COEFFICIENTS);
            const { assert!(P::USES_VALUE && P::CELL_DATA == 0) };
        }
        let ranges: Vec<Vec<[f64; 2]>> = sources.iter().map(|s| layer_ranges(&grid, s)).collect();
        let half = half_offsets::<D>().len();
        let element = crate::stencil::constant_element::<D>(&grid, background);
        let mut out = self.matrix.take();
        out.clear();
        out.resize((half + 1) * n, 0.0);
        let parallel = grid.n_cells() >= PARALLEL_CELLS;
        let moments = &self.moments;
        over_slabs(&grid, half + 1, &mut out, parallel, |slab| {
            moments.with(Vec::new, |moments| {
                T::dispatch(
                    SimdLevel::active(),
                    SlabTask {
                        grid: &grid,
                        rule,
                        sources,
                        ranges: &ranges,
                        element: &element,
                        background,
                        moments,
                        slab,
                    },
                );
            });
        });
        self.rhs.copy_from_slice(&out[half * n..]);
        out.truncate(half * n);
        self.matrix.restore(out);
    }
}

/// For every row of cells, the smallest and largest deformed coordinate along the last axis, in
/// units of the spacing: a multilinear map stays between its corner values.
fn layer_ranges<T: Element, const D: usize>(
    grid: &Grid<D>,
    source: &Source<'_, T>,
) -> Vec<[f64; 2]> {
    let n = grid.n_nodes();
    let last = &source.displacement[(D - 1) * n..];
    let nodes = grid.nodes_per_axis();
    let inverse_h = 1.0 / grid.spacing();
    let rows: Vec<Row> = (0..grid.cells_per_axis()[D - 1])
        .flat_map(|layer| rows_of_layer(grid, layer))
        .collect();
    rows.par_iter()
        .with_min_len(64)
        .map(|&row| {
            let mut range = [f64::INFINITY, f64::NEG_INFINITY];
            for side in 0..1 << (D - 1) {
                let c = 2 * side;
                let start = first_node(grid, row, c);
                let plane = row[D - 2] + (c >> (D - 1) & 1);
                for &u in &last[start..start + nodes[0]] {
                    let y = u.to_f64() * inverse_h + plane as f64;
                    range = [range[0].min(y), range[1].max(y)];
                }
            }
            range
        })
        .collect()
}

struct SlabTask<'a, T: Element, P, const D: usize> {
    grid: &'a Grid<D>,
    rule: &'a P,
    sources: &'a [Source<'a, T>],
    ranges: &'a [Vec<[f64; 2]>],
    element: &'a [[f64; MAX_CORNERS]; MAX_CORNERS],
    background: Background,
    /// Memory for the moments.
    moments: &'a mut Vec<f64>,
    slab: Slab<'a, f64>,
}

/// Points of one row of cells, `[quantity][point][cell]`: the number of the cell that a point
/// falls into, counted from the first of the slab, the local coordinates there, and the weights.
struct RowPoints<T> {
    data: Vec<T>,
    length: usize,
}

impl<T: Element, P: PointWeights<D>, const D: usize> LaneKernel<T> for SlabTask<'_, T, P, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = T>>(mut self) {
        let cells = self.grid.cells_per_axis();
        let per_layer: usize = cells[..D - 1].iter().product();
        let stride = const { moment_stride(D as u32) };
        let layers = self.slab.layers.clone();
        let count = layers.len() * per_layer * stride;
        let mut memory = std::mem::take(self.moments);
        memory.clear();
        memory.resize(count + CACHE_LINE, 0.0);
        let first = memory.as_ptr().align_offset(CACHE_LINE);
        let moments = memory.get_mut(first..first + count).unwrap_or_default();
        let length = cells[0];
        let mut points = RowPoints {
            data: vec![T::default(); (D + 3) * (1 << D) * length],
            length,
        };
        let (low, high) = self.slab.reach(cells[D - 1]);
        let mut block = Block::<L, D, D>::zero::<P>(self.grid);
        for (source, ranges) in self.sources.iter().zip(self.ranges) {
            let mut row_number = 0;
            for layer in 0..cells[D - 1] {
                for row in rows_of_layer(self.grid, layer) {
                    let [least, most] = ranges[row_number];
                    row_number += 1;
                    if least <= high && most >= low {
                        self.evaluate::<L>(source, row, &mut block, &mut points);
                        accumulate::<T, D>(&points, moments);
                    }
                }
            }
        }
        self.finish(moments, stride);
        *self.moments = memory;
    }
}

impl<T: Element, P: PointWeights<D>, const D: usize> SlabTask<'_, T, P, D> {
    #[inline(always)]
    fn evaluate<L: Lane<Element = T>>(
        &self,
        source: &Source<'_, T>,
        row: Row,
        block: &mut Block<L, D, D>,
        points: &mut RowPoints<T>,
    ) {
        let weight = L::splat(self.grid.cell_volume() / f64::from(1u32 << D));
        let data = Data {
            coefficients: source.coefficients,
            cells: &[],
        };
        let length = points.length;
        let cells = self.grid.cells_per_axis();
        let first_layer = L::splat(self.slab.layers.start as f64);
        let nodes = RowData::new::<P>(self.grid, source.displacement, &data, row);
        for i in block_starts::<L>(length) {
            block.read::<P, T>(&nodes, i);
            for q in 0..1usize << D {
                let p = block.point(q);
                let mut deformed = p.position;
                for k in 0..D {
                    deformed[k] += p.value[k];
                }
                let (a, b) = self.rule.weights(&p, &deformed);
                let at = locate_lanes(self.grid, &deformed);
                let mut quantity = 0;
                let mut put = |x: L| {
                    let start = (quantity * (1 << D) + q) * length;
                    x.store(&mut points.data[start + i..start + length]);
                    quantity += 1;
                };
                // Whole numbers, exact while the slab has fewer cells than the mantissa has values.
                let mut cell = at.cell[D - 1] - first_layer;
                for k in (0..D - 1).rev() {
                    cell = cell.mul_add(L::splat(cells[k] as f64), at.cell[k]);
                }
                put(cell);
                for k in 0..D {
                    put(at.local[k]);
                }
                put(a * weight);
                put(b * weight);
            }
        }
    }

    /// Moments of the cells to matrix entries and right-hand side at the nodes.
    #[inline(always)]
    fn finish(&mut self, moments: &[f64], stride: usize) {
        let n = self.grid.nodes_per_axis();
        let plane = if D == 3 { n[0] * n[1] } else { n[0] };
        let pairs = corner_pairs::<D>();
        let rhs = half_offsets::<D>().len();
        let load = self.background.load * self.grid.cell_volume() / f64::from(1u32 << D);
        let products = const { first_moments(D as u32) };
        let length = n[0] - 1;
        let mut rows = moments.chunks_exact(stride * length);
        for layer in self.slab.layers.clone() {
            for (row, blocks) in rows_of_layer(self.grid, layer).zip(&mut rows) {
                let y = if D == 3 { row[0] } else { 0 };
                let mut add = |output: usize, a: usize, moment: usize, constant: f64| {
                    let start = if D == 3 { (y + (a >> 1 & 1)) * n[0] } else { 0 } + (a & 1);
                    let target = self.slab.plane(output, layer, a >> (D - 1), plane);
                    let blocks = blocks.chunks_exact(stride);
                    for (t, block) in target[start..start + length].iter_mut().zip(blocks) {
                        *t += block[moment] + constant;
                    }
                };
                for pair in &pairs {
                    let a = pair.corner;
                    add(pair.offset, a, pair.moment, self.element[a][pair.other]);
                }
                for a in 0..1usize << D {
                    add(rhs, a, products + a, load);
                }
            }
        }
    }
}

/// Adds the points of a row to the moments of the cells of a slab; other points are left out.
#[inline(always)]
fn accumulate<T: Element, const D: usize>(points: &RowPoints<T>, moments: &mut [f64]) {
    let stride = const { moment_stride(D as u32) };
    let n_cells = (moments.len() / stride) as f64;
    let n_points = points.length << D;
    let quantity = |k: usize| &points.data[k * n_points..(k + 1) * n_points];
    let (cells, first, second) = (quantity(0), quantity(D + 1), quantity(D + 2));
    let locals: [&[T]; D] = std::array::from_fn(|k| quantity(k + 1));
    for i in 0..points.length {
        for q in 0..1usize << D {
            let point = q * points.length + i;
            let cell = cells[point].to_f64();
            if !(0.0..n_cells).contains(&cell) {
                continue;
            }
            let block = &mut moments[cell as usize * stride..][..stride];
            let (a, b) = (first[point].to_f64(), second[point].to_f64());
            let s = locals[0][point].to_f64();
            let r = 1.0 - s;
            let (along_x, line) = ([r * r, r * s, s * s, 0.0], [r, s]);
            // The products of the other axes.
            let mut quadratic = [0.0; MAX_PRODUCTS];
            let mut linear = [0.0; MAX_CORNERS / 2];
            (quadratic[0], linear[0]) = (a, b);
            let (mut n_quadratic, mut n_linear) = (1, 1);
            for k in 1..D {
                let s = locals[k][point].to_f64();
                let r = 1.0 - s;
                for j in 0..n_quadratic {
                    let base = quadratic[j];
                    quadratic[j] = base * (r * r);
                    quadratic[n_quadratic + j] = base * (r * s);
                    quadratic[2 * n_quadratic + j] = base * (s * s);
                }
                for j in 0..n_linear {
                    let base = linear[j];
                    linear[j] = base * r;
                    linear[n_linear + j] = base * s;
                }
                n_quadratic *= 3;
                n_linear *= 2;
            }
            let (squares, loads) = block.split_at_mut(const { first_moments(D as u32) });
            for (row, q) in squares.chunks_exact_mut(4).zip(quadratic) {
                for (moment, x) in row.iter_mut().zip(along_x) {
                    *moment = x.mul_add(q, *moment);
                }
            }
            for (row, l) in loads.chunks_exact_mut(2).zip(linear).take(1 << (D - 1)) {
                for (moment, x) in row.iter_mut().zip(line) {
                    *moment = x.mul_add(l, *moment);
                }
            }
        }
    }
}

/// Numbers a cell: rows of three second moments along `x`, filled up to four, and the first
/// moments of the corners; whole cache lines.
const fn moment_stride(d: u32) -> usize {
    (first_moments(d) + (1 << d)).next_multiple_of(CACHE_LINE / size_of::<f64>())
}

/// Where the first moments stand among the numbers of a cell.
const fn first_moments(d: u32) -> usize {
    4 * 3usize.pow(d - 1)
}

/// A pair of corners of a cell whose difference is one of the stored offsets.
struct CornerPair {
    corner: usize,
    other: usize,
    offset: usize,
    moment: usize,
}

fn corner_pairs<const D: usize>() -> Vec<CornerPair> {
    let offsets = half_offsets::<D>();
    let mut pairs = Vec::new();
    for corner in 0..1usize << D {
        for other in 0..1usize << D {
            let bit = |c: usize, k: usize| (c >> k & 1) as isize;
            let difference: [isize; D] = std::array::from_fn(|k| bit(other, k) - bit(corner, k));
            if let Some(offset) = offsets.iter().position(|o| *o == difference) {
                let digit = |k: usize| (bit(corner, k) + bit(other, k)) as usize;
                let moment = 4 * (1..D).rev().fold(0, |m, k| 3 * m + digit(k)) + digit(0);
                pairs.push(CornerPair {
                    corner,
                    other,
                    offset,
                    moment,
                });
            }
        }
    }
    pairs
}
