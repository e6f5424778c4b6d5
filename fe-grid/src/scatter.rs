//! Sums over deformed quadrature points of products of shape functions: the adjoint of a
//! composition with respect to the composed field, and the normal equations for that field.
//!
//! For sources `(u_i, c_i)` and a [`PointWeights`] rule that gives two numbers `a, b` at every
//! quadrature point, [`normal_equations`] assembles
//!
//! ```text
//! A = sum_i c_i sum_q w a N(Phi_i(x_q)) N(Phi_i(x_q))^T,    r = sum_i c_i sum_q w b N(Phi_i(x_q)),
//! ```
//!
//! with weights `c_i` of the sources, `Phi_i(x) = x + u_i(x)` and `N(y)` the vector of all shape functions at `y`. In a cell
//! the products `N N^T` span no more than `3^D` functions, the tensor products of `(1-s)^2`,
//! `s(1-s)`, `s^2`: a point adds to `3^D` moments of its cell, and moments become matrix entries
//! once all points are in.
//!
//! Every slab of cells is processed by one task, which searches the sources for points inside it, one
//! source after the other: what each adds is independent of the number of threads. Where the sources are
//! [distributed](Distribution) to processes, the terms of the sum over sources are rounded such that it
//! is exact, and independent of the order, too.

use crate::composition::locate_lanes;
use crate::distribution::{Distribution, Quantum};
use crate::engine::block::{Block, RowData};
use crate::engine::element::MAX_CORNERS;
use crate::engine::kernel::CACHE_LINE;
use crate::engine::rows::{Row, first_node, rows_of_layer};
use crate::engine::slabs::{Slab, over_slabs};
use crate::engine::{Data, Point, Reads};
use crate::grid::Grid;
use crate::lane::{Element, Lane, LaneKernel};
use crate::moments::{RUN, RunPoints, accumulate, first_moments, moment_stride};
use crate::parallel;
use crate::pool::Pool;
use crate::stencil::{Background, SymmetricStencil, corner_pairs, half_offsets};

/// Below this number of cells everything stays on one thread.
const PARALLEL_CELLS: usize = 1024;

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
    /// Factor of both numbers.
    pub weight: f64,
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
    equations.assemble(rule, sources, background, None);
    (equations.matrix, equations.rhs)
}

/// Normal equations with the memory to assemble them again and again.
#[derive(Debug)]
pub struct NormalEquations<const D: usize> {
    matrix: SymmetricStencil<D>,
    rhs: Vec<f64>,
    moments: Pool<Vec<f64>>,
    /// Whether the matrix is kept in single precision.
    single: bool,
}

/// Sources that are distributed to processes: each is one part, and `sources` are the own ones.
#[derive(Clone, Copy, Debug)]
pub struct DistributedSources<'a> {
    /// The distribution.
    pub distribution: &'a Distribution,
    /// Bound of the moments of a source where it does not compress: the volume of a cell times the larger
    /// of the two numbers. Larger moments cost a second assembly.
    pub moment: f64,
}

/// The moments of a source may be this many times as large as expected; more cost a further assembly. The
/// more room, the larger the multiples that they are rounded to.
const ROOM: f64 = 64.0;

impl<const D: usize> NormalEquations<D> {
    /// Empty equations: zero.
    pub fn new(grid: Grid<D>) -> Self {
        let n = grid.n_nodes();
        let half = half_offsets::<D>().len();
        // While they are assembled, the right-hand side lies behind the matrix.
        let mut coupling = vec![0.0; (half + 1) * n];
        coupling.truncate(half * n);
        Self {
            matrix: SymmetricStencil::new(grid, coupling, false),
            rhs: vec![0.0; n],
            moments: Pool::new(),
            single: false,
        }
    }

    /// The same whose matrix is kept in single precision. It is assembled in double precision, in memory that
    /// is needed for that long only.
    pub fn in_single(grid: Grid<D>) -> Self {
        Self {
            matrix: SymmetricStencil::new(
                grid,
                vec![0.0; half_offsets::<D>().len() * grid.n_nodes()],
                true,
            ),
            rhs: vec![0.0; grid.n_nodes()],
            moments: Pool::new(),
            single: true,
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

    /// Assembles as [`normal_equations`] does. With a distribution, all processes have the equations of
    /// all sources afterwards, with the same bits on any number of processes; collective.
    ///
    /// # Panics
    /// If a source does not fit the grid, or the distribution the number of sources.
    pub fn assemble<T: Element, P: PointWeights<D>>(
        &mut self,
        rule: &P,
        sources: &[Source<'_, T>],
        background: Background,
        distributed: Option<DistributedSources<'_>>,
    ) {
        let grid = *self.matrix.grid();
        let n = grid.n_nodes();
        for source in sources {
            assert_eq!(source.displacement.len(), D * n);
            assert!(source.coefficients.len() >= P::COEFFICIENTS);
            const { assert!(P::USES_VALUE && P::CELL_DATA == 0) };
        }
        let ranges: Vec<Vec<[f64; 2]>> = sources.iter().map(|s| layer_ranges(&grid, s)).collect();
        let sum = Sum {
            grid: &grid,
            rule,
            sources,
            ranges: &ranges,
            quantum: Quantum::of_sums(0.0),
            moments: &self.moments,
        };
        let half = half_offsets::<D>().len();
        let mut out = self.matrix.take();
        out.resize((half + 1) * n, 0.0);
        match distributed {
            None => {
                sum.assemble(&mut out);
            }
            Some(distributed) => sum.assemble_distributed(distributed, &mut out),
        }
        let element = crate::stencil::constant_element::<D>(&grid, background);
        let load = background.load * grid.cell_volume() / f64::from(1u32 << D);
        over_slabs(&grid, half + 1, &mut out, is_parallel(&grid), &|slab| {
            add_background(&grid, slab, &element, load);
        });
        self.rhs.copy_from_slice(&out[half * n..]);
        out.truncate(half * n);
        self.matrix = SymmetricStencil::new(grid, out, self.single);
    }
}

fn is_parallel<const D: usize>(grid: &Grid<D>) -> bool {
    grid.n_cells() >= PARALLEL_CELLS
}

/// The sum of what sources add to the entries of the matrix and the right-hand side.
struct Sum<'a, T, P, const D: usize> {
    grid: &'a Grid<D>,
    rule: &'a P,
    sources: &'a [Source<'a, T>],
    /// Of each source, [`layer_ranges`].
    ranges: &'a [Vec<[f64; 2]>],
    /// What the moments of each source are rounded to.
    quantum: Quantum,
    moments: &'a Pool<Vec<f64>>,
}

impl<T: Element, P: PointWeights<D>, const D: usize> Sum<'_, T, P, D> {
    /// Overwrites `out` by the sum; returns the largest moment of a source.
    fn assemble(&self, out: &mut [f64]) -> f64 {
        out.fill(0.0);
        let outputs = half_offsets::<D>().len() + 1;
        let parallel = is_parallel(self.grid);
        let largest = over_slabs(self.grid, outputs, out, parallel, &|slab| {
            self.moments.with(Vec::new, |memory| {
                T::run_kernel(SlabTask {
                    sum: self,
                    memory,
                    slab,
                })
            })
        });
        largest.into_iter().fold(0.0, f64::max)
    }

    /// The sum over the sources of all processes.
    fn assemble_distributed(mut self, sources: DistributedSources<'_>, out: &mut [f64]) {
        let distribution = sources.distribution;
        assert_eq!(self.sources.len(), distribution.own().len());
        let n = distribution.n_parts() as f64;
        let mut room = ROOM;
        loop {
            // An entry is the sum of a moment of every cell about its node.
            let cells = f64::from(1u32 << D);
            self.quantum = Quantum::of_sums(room * n * cells * sources.moment);
            let mut largest = [self.assemble(out)];
            distribution.communicator().maximum(&mut largest);
            // What is not finite does not become so with more room.
            if largest[0] <= room * sources.moment || !largest[0].is_finite() || room > 1e100 {
                break;
            }
            room *= ROOM;
        }
        distribution.communicator().sum(out);
    }
}

/// Adds the entries of an element that is the same for all cells, and a load at every corner.
fn add_background<const D: usize>(
    grid: &Grid<D>,
    mut slab: Slab<'_, f64>,
    element: &[[f64; MAX_CORNERS]; MAX_CORNERS],
    load: f64,
) {
    let rhs = half_offsets::<D>().len();
    let pairs = corner_pairs_with_moments::<D>();
    for layer in slab.layers.clone() {
        for row in rows_of_layer(grid, layer) {
            let mut add = |output: usize, a: usize, constant: f64| {
                for x in entries_of_row(grid, &mut slab, layer, row, output, a) {
                    *x += constant;
                }
            };
            for pair in &pairs {
                add(pair.offset, pair.corner, element[pair.corner][pair.other]);
            }
            for a in 0..1usize << D {
                add(rhs, a, load);
            }
        }
    }
}

/// The entries of one output at one corner of the cells of a row.
#[inline(always)]
fn entries_of_row<'a, const D: usize>(
    grid: &Grid<D>,
    slab: &'a mut Slab<'_, f64>,
    layer: usize,
    row: Row,
    output: usize,
    corner: usize,
) -> &'a mut [f64] {
    let n = grid.nodes_per_axis();
    let plane = plane_size(grid);
    let y = if D == 3 { row[0] } else { 0 };
    let line = if D == 3 {
        (y + (corner >> 1 & 1)) * n[0]
    } else {
        0
    };
    let start = line + (corner & 1);
    let nodes = slab.plane(output, layer, corner >> (D - 1), plane);
    &mut nodes[start..start + n[0] - 1]
}

/// Number of nodes of a plane across the last axis.
fn plane_size<const D: usize>(grid: &Grid<D>) -> usize {
    let n = grid.nodes_per_axis();
    if D == 3 { n[0] * n[1] } else { n[0] }
}

/// For every run of cells, row by row, the smallest and largest deformed coordinate along the
/// last axis, in units of the spacing: a multilinear map stays between its corner values.
pub(crate) fn layer_ranges<T: Element, const D: usize>(
    grid: &Grid<D>,
    source: &Source<'_, T>,
) -> Vec<[f64; 2]> {
    let last = &source.displacement[(D - 1) * grid.n_nodes()..];
    let cells = grid.cells_per_axis();
    let inverse_h = 1.0 / grid.spacing();
    let rows: Vec<Row> = (0..cells[D - 1])
        .flat_map(|layer| rows_of_layer(grid, layer))
        .collect();
    let runs = cells[0].div_ceil(RUN);
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; runs * rows.len()];
    parallel::for_each_chunk(&mut ranges, runs, 64, &|r, ranges| {
        let row = rows[r];
        for side in 0..1 << (D - 1) {
            let c = 2 * side;
            let plane = (row[D - 2] + (c >> (D - 1) & 1)) as f64;
            let nodes = &last[first_node(grid, row, c)..][..=cells[0]];
            for (run, range) in ranges.iter_mut().enumerate() {
                let end = ((run + 1) * RUN).min(cells[0]);
                let line = Extremes(&nodes[run * RUN..=end]);
                let [least, most] = T::run_kernel(line);
                range[0] = range[0].min(least * inverse_h + plane);
                range[1] = range[1].max(most * inverse_h + plane);
            }
        }
    });
    ranges
}

/// The least and the largest of some numbers.
struct Extremes<'a, T>(&'a [T]);

impl<T: Element> LaneKernel<T> for Extremes<'_, T> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) -> [f64; 2] {
        let mut least = [T::splat(f64::INFINITY); RUN];
        let mut most = [T::splat(f64::NEG_INFINITY); RUN];
        let (whole, rest) = self.0.split_at(self.0.len() / L::COUNT * L::COUNT);
        let (mut low, mut high) = (L::splat(f64::INFINITY), L::splat(f64::NEG_INFINITY));
        for x in whole.chunks_exact(L::COUNT) {
            let x = L::load(x);
            // In this order a NaN is passed over.
            low = x.min(low);
            high = x.max(high);
        }
        low.store(&mut least);
        high.store(&mut most);
        for (i, &x) in rest.iter().enumerate() {
            least[i] = Lane::min(x, least[i]);
            most[i] = Lane::max(x, most[i]);
        }
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for (l, m) in least.iter().zip(&most) {
            range = [range[0].min(l.to_f64()), range[1].max(m.to_f64())];
        }
        range
    }
}

struct SlabTask<'a, T: Element, P, const D: usize> {
    sum: &'a Sum<'a, T, P, D>,
    /// Memory for the moments of all sources and of one.
    memory: &'a mut Vec<f64>,
    slab: Slab<'a, f64>,
}

impl<T: Element, P: PointWeights<D>, const D: usize> LaneKernel<T> for SlabTask<'_, T, P, D> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lane<Element = T>>(mut self) -> f64 {
        let grid = self.sum.grid;
        let cells = grid.cells_per_axis();
        let per_layer: usize = cells[..D - 1].iter().product();
        let stride = const { moment_stride(D as u32) };
        let layers = self.slab.layers.clone();
        let count = layers.len() * per_layer * stride;
        let mut memory = std::mem::take(self.memory);
        memory.clear();
        memory.resize(2 * count + CACHE_LINE, 0.0);
        let first = memory.as_ptr().align_offset(CACHE_LINE);
        let both = memory.get_mut(first..first + 2 * count).unwrap_or_default();
        let (sum, own) = both.split_at_mut(count);
        let mut largest = 0.0;
        for (source, ranges) in self.sum.sources.iter().zip(self.sum.ranges) {
            self.accumulate_source::<L>(source, ranges, own);
            largest = f64::max(largest, add_rounded(self.sum.quantum, own, sum));
        }
        finish(grid, sum, &mut self.slab);
        *self.memory = memory;
        largest
    }
}

/// Adds rounded moments of a source to the sum, and leaves zeros; returns the largest absolute value.
#[inline(always)]
fn add_rounded(quantum: Quantum, own: &mut [f64], sum: &mut [f64]) -> f64 {
    let mut largest = 0.0;
    for (sum, own) in sum.iter_mut().zip(own) {
        *sum += quantum.round(*own);
        let size = own.abs();
        // Not `max`, which is slower for its rule on NaN: that stays in the sum.
        largest = if size > largest { size } else { largest };
        *own = 0.0;
    }
    largest
}

impl<T: Element, P: PointWeights<D>, const D: usize> SlabTask<'_, T, P, D> {
    /// Adds the points of a source to the moments of the cells that they are moved to.
    #[inline(always)]
    fn accumulate_source<L: Lane<Element = T>>(
        &self,
        source: &Source<'_, T>,
        ranges: &[[f64; 2]],
        moments: &mut [f64],
    ) {
        let grid = self.sum.grid;
        let cells = grid.cells_per_axis();
        let runs = cells[0].div_ceil(RUN);
        let (low, high) = self.slab.reach(cells[D - 1]);
        let reached = |range: &[f64; 2]| range[0] <= high && range[1] >= low;
        let factor = mutant!(source.weight, ScatterWeight => 1.0);
        let mut block = Block::<L, D, D>::zero::<P>(grid);
        let mut points = RunPoints::new();
        // Rows above each other fall into cells beside each other, whose moments are then still in the
        // cache: all rows of one `y` follow each other.
        let rows_per_layer: usize = cells[1..D - 1].iter().product();
        for y in 0..rows_per_layer {
            for layer in 0..cells[D - 1] {
                let first = (layer * rows_per_layer + y) * runs;
                let ranges = &ranges[first..first + runs];
                if !ranges.iter().any(reached) {
                    continue;
                }
                let row = if D == 3 { [y, layer] } else { [layer, 0] };
                let data = Data {
                    coefficients: source.coefficients,
                    cells: &[],
                };
                let nodes = RowData::new::<P>(grid, source.displacement, &data, row);
                for (run, range) in ranges.iter().enumerate() {
                    if reached(range) {
                        self.evaluate(&nodes, run * RUN, factor, &mut block, &mut points);
                        accumulate::<L, T, D>(&points, moments);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn evaluate<L: Lane<Element = T>>(
        &self,
        nodes: &RowData<'_, T, D, D>,
        first: usize,
        factor: f64,
        block: &mut Block<L, D, D>,
        points: &mut RunPoints<T, D>,
    ) {
        let grid = self.sum.grid;
        let weight = L::splat(factor * grid.cell_volume() / f64::from(1u32 << D));
        let cells = grid.cells_per_axis();
        let first_layer = L::splat(self.slab.layers.start as f64);
        points.length = RUN.min(cells[0] - first);
        for i in (0..points.length).step_by(L::COUNT) {
            block.read::<P, T>(nodes, first + i);
            for q in 0..1usize << D {
                let p = block.point(q);
                let mut deformed = p.position;
                for k in 0..D {
                    deformed[k] += p.value[k];
                }
                let (a, b) = self.sum.rule.weights(&p, &deformed);
                let at = locate_lanes(grid, &deformed);
                let start = RunPoints::<T, D>::start(q) + i;
                let mut places = points.data[start..].chunks_mut(RUN);
                let mut put = |x: L| {
                    if let Some(place) = places.next() {
                        x.store(place);
                    }
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
}

/// Moments of the cells to matrix entries and right-hand side at the nodes.
#[inline(always)]
fn finish<const D: usize>(grid: &Grid<D>, moments: &[f64], slab: &mut Slab<'_, f64>) {
    let stride = const { moment_stride(D as u32) };
    let pairs = corner_pairs_with_moments::<D>();
    let rhs = half_offsets::<D>().len();
    let products = const { first_moments(D as u32) };
    let mut rows = moments.chunks_exact(stride * grid.cells_per_axis()[0]);
    for layer in slab.layers.clone() {
        for (row, blocks) in rows_of_layer(grid, layer).zip(&mut rows) {
            let mut add = |output: usize, a: usize, moment: usize| {
                let entries = entries_of_row(grid, slab, layer, row, output, a);
                for (x, block) in entries.iter_mut().zip(blocks.chunks_exact(stride)) {
                    *x += block[moment];
                }
            };
            for pair in &pairs {
                add(pair.offset, pair.corner, pair.moment);
            }
            for a in 0..1usize << D {
                add(rhs, a, products + a);
            }
        }
    }
}

/// A pair of corners of a cell whose difference is one of the stored offsets.
struct CornerPair {
    corner: usize,
    other: usize,
    offset: usize,
    moment: usize,
}

fn corner_pairs_with_moments<const D: usize>() -> Vec<CornerPair> {
    let bit = |c: usize, k: usize| c >> k & 1;
    let pairs = corner_pairs::<D>().into_iter();
    let with_moment = pairs.map(|(corner, other, offset)| {
        let digit = |k: usize| bit(corner, k) + bit(other, k);
        CornerPair {
            corner,
            other,
            offset,
            moment: 4 * (1..D).rev().fold(0, |m, k| 3 * m + digit(k)) + digit(0),
        }
    });
    with_moment.collect()
}
