//! Symmetric matrices that couple a node with its `3^D` neighbours: one number a coupling
//! ([`SymmetricStencil`]) or a block of them ([`BlockStencil`]).
//!
//! Of each pair of couplings one is stored: `(3^D + 1) / 2` nodal arrays (of each entry of a
//! block), for the offset zero and the offsets that come after it in memory.

use crate::compiled_once;
use crate::engine::element::{GAUSS, MAX_CORNERS, shape_derivative, shape_value};
use crate::grid::Grid;
use crate::lane::{Element, Lane, LaneKernel, Numbers};
use crate::linear::LinearOperator;
use crate::parallel;
use crate::vector::in_double;
use std::borrow::Cow;

/// The offsets that are stored: zero first, then all that come later in memory, in order.
pub fn half_offsets<const D: usize>() -> Vec<[isize; D]> {
    let all = 3usize.pow(D as u32);
    (all / 2..all)
        .map(|code| std::array::from_fn(|k| (code / 3usize.pow(k as u32) % 3) as isize - 1))
        .collect()
}

/// Pairs of corners of a cell whose difference is one of the stored offsets, with its place: corner, other corner and
/// offset.
pub(crate) fn corner_pairs<const D: usize>() -> Vec<(usize, usize, usize)> {
    let offsets = half_offsets::<D>();
    let mut pairs = Vec::new();
    for corner in 0..1usize << D {
        for other in 0..1usize << D {
            let bit = |c: usize, k: usize| (c >> k & 1) as isize;
            let difference: [isize; D] = std::array::from_fn(|k| bit(other, k) - bit(corner, k));
            if let Some(offset) = offsets.iter().position(|o| *o == difference) {
                pairs.push((corner, other, offset));
            }
        }
    }
    pairs
}

/// A symmetric matrix over the nodes of a grid.
#[derive(Clone, Debug)]
pub struct SymmetricStencil<const D: usize> {
    grid: Grid<D>,
    /// One nodal array for each of [`half_offsets`]: the coupling of a node with the node at
    /// that offset. Couplings that leave the grid are zero.
    coupling: Coupling,
}

/// Couplings in either precision.
#[derive(Clone, Debug)]
enum Coupling {
    Double(Vec<f64>),
    Single(Vec<f32>),
}

impl Coupling {
    fn numbers(&self) -> Numbers<'_> {
        match self {
            Self::Double(numbers) => Numbers::Double(numbers),
            Self::Single(numbers) => Numbers::Single(numbers),
        }
    }
}

impl<const D: usize> SymmetricStencil<D> {
    /// The matrix with these couplings, kept in single precision if that is wanted.
    pub(crate) fn new(grid: Grid<D>, coupling: Vec<f64>, single: bool) -> Self {
        assert_eq!(coupling.len(), half_offsets::<D>().len() * grid.n_nodes());
        let coupling = if single {
            Coupling::Single(coupling.iter().map(|x| *x as f32).collect())
        } else {
            Coupling::Double(coupling)
        };
        Self { grid, coupling }
    }

    /// The memory of the couplings in double precision, for new ones; zero until then.
    pub(crate) fn take(&mut self) -> Vec<f64> {
        match std::mem::replace(&mut self.coupling, Coupling::Double(Vec::new())) {
            Coupling::Double(numbers) => numbers,
            Coupling::Single(_) => Vec::new(),
        }
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Cow<'_, [f64]> {
        match &self.coupling {
            Coupling::Double(numbers) => numbers[..self.grid.n_nodes()].into(),
            Coupling::Single(numbers) => in_double(&numbers[..self.grid.n_nodes()]),
        }
    }

    /// Sums of the rows, `A 1`.
    pub fn row_sums(&self) -> Vec<f64> {
        let ones = vec![1.0; self.grid.n_nodes()];
        let mut sums = vec![0.0; ones.len()];
        self.apply_into(&ones, &mut sums);
        sums
    }

    /// All entries that are not outside the grid: row, column, and the number there.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let n = self.grid.n_nodes();
        let coupling = move |i: usize| match &self.coupling {
            Coupling::Double(numbers) => numbers[i],
            Coupling::Single(numbers) => f64::from(numbers[i]),
        };
        let offsets = half_offsets::<D>().into_iter().enumerate();
        let stored = offsets.flat_map(move |(o, offset)| (0..n).map(move |i| (o, offset, i)));
        stored.flat_map(move |(o, offset, i)| {
            let a = coupling(o * n + i);
            let j = self.neighbour(i, offset);
            let above = j.map(|j| (i, j, a));
            let below = j.filter(|&j| j != i).map(|j| (j, i, a));
            above.into_iter().chain(below)
        })
    }

    fn neighbour(&self, node: usize, offset: [isize; D]) -> Option<usize> {
        let nodes = self.grid.nodes_per_axis();
        let node = self.grid.node(node);
        let other: [isize; D] = std::array::from_fn(|k| node[k] as isize + offset[k]);
        let inside = (0..D).all(|k| (0..nodes[k] as isize).contains(&other[k]));
        inside.then(|| self.grid.node_index(other.map(|x| x as usize)))
    }
}

impl<const D: usize> LinearOperator for SymmetricStencil<D> {
    fn dim(&self) -> usize {
        self.grid.n_nodes()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        multiply_nodes(&self.grid, self.coupling.numbers(), x, y);
    }
}

compiled_once! {
    /// `y = A x` for one number a node.
    fn multiply_nodes<'a, D>(
        grid: &'a Grid<D>,
        coupling: Numbers<'a>,
        x: &'a [f64],
        y: &'a mut [f64],
    ) = multiply_nodes_in;
}

fn multiply_nodes_in<const D: usize>(
    grid: &Grid<D>,
    coupling: Numbers<'_>,
    x: &[f64],
    y: &mut [f64],
) {
    match coupling {
        Numbers::Double(coupling) => multiply::<f64, D, 1>(grid, coupling, x, y),
        Numbers::Single(coupling) => multiply::<f32, D, 1>(grid, coupling, x, y),
    }
}

/// A symmetric matrix over the nodes of a grid whose entries are `M` x `M` blocks. Vectors hold
/// component by component, as fields do.
#[derive(Clone, Debug)]
pub struct BlockStencil<const D: usize, const M: usize> {
    grid: Grid<D>,
    /// For each of [`half_offsets`] and each entry `(r, s)` of a block, row by row, a nodal array:
    /// what component `s` of the node at that offset adds to component `r` of a node. Couplings
    /// that leave the grid are zero.
    coupling: Vec<f64>,
}

impl<const D: usize, const M: usize> BlockStencil<D, M> {
    pub(crate) fn from_parts(grid: Grid<D>, coupling: Vec<f64>) -> Self {
        let arrays = M * M * half_offsets::<D>().len();
        assert_eq!(coupling.len(), arrays * grid.n_nodes());
        Self { grid, coupling }
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }
}

impl<const D: usize, const M: usize> LinearOperator for BlockStencil<D, M> {
    fn dim(&self) -> usize {
        M * self.grid.n_nodes()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        multiply::<f64, D, M>(&self.grid, &self.coupling, x, y);
    }
}

/// Nodes from which on the rows of a product go to threads.
const PARALLEL_NODES: usize = 16384;
/// Registers of nodes of a row that are summed up at the same time: one sum waits for each of its products.
const AT_ONCE: usize = 2;
/// Most neighbours of a node, with itself.
const MAX_NEIGHBOURS: usize = 27;

/// `y = A x` for couplings as [`BlockStencil`] stores them.
fn multiply<T: Element, const D: usize, const M: usize>(
    grid: &Grid<D>,
    coupling: &[T],
    x: &[f64],
    y: &mut [f64],
) {
    let (n, total) = (grid.nodes_per_axis(), grid.n_nodes());
    let plane = if D == 3 { n[0] * n[1] } else { 16 * n[0] };
    // All components of a node at once: a block is read for its node and for the neighbour, soon after.
    let mut components = y.chunks_exact_mut(total);
    let mut parts: [_; M] = std::array::from_fn(|_| {
        let component = components.next().unwrap_or_default();
        component.chunks_mut(plane)
    });
    let planes = (0..total.div_ceil(plane)).map(|p| PlaneProduct::<T, D, M> {
        grid,
        coupling,
        x,
        first_row: p * plane / n[0],
        out: std::array::from_fn(|c| parts[c].next().unwrap_or_default()),
    });
    let work = |product: PlaneProduct<'_, T, D, M>| {
        <f64 as crate::Element>::run_kernel(product);
    };
    if total < PARALLEL_NODES {
        planes.for_each(work);
    } else {
        parallel::for_each(planes, &work);
    }
}

/// Some rows of nodes of the product.
struct PlaneProduct<'a, T, const D: usize, const M: usize> {
    grid: &'a Grid<D>,
    coupling: &'a [T],
    x: &'a [f64],
    first_row: usize,
    /// These rows of every component.
    out: [&'a mut [f64]; M],
}

/// The neighbours of the nodes of a row at one offset.
#[derive(Clone, Copy, Default)]
struct Neighbours {
    /// Number of the stored offset.
    array: usize,
    /// Whether the block of a node is stored with the node. It is that of the neighbour otherwise, whose
    /// transpose counts.
    forward: bool,
    /// Where the blocks of the row, and its neighbours, start. At one end of the row there may be no
    /// neighbour: the block there is zero.
    block: usize,
    neighbour: usize,
    /// The nodes of the row with a neighbour.
    from: usize,
    to: usize,
}

impl<T: Element, const D: usize, const M: usize> LaneKernel<f64> for PlaneProduct<'_, T, D, M> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(mut self) {
        let width = self.grid.nodes_per_axis()[0];
        for r in 0..self.out[0].len() / width {
            let (neighbours, count) = self.neighbours(self.first_row + r);
            let neighbours = &neighbours[..count];
            // In the first and the last row of all, what is beside them is not in memory.
            let total = self.grid.n_nodes();
            let whole = |of: &Neighbours| {
                of.neighbour
                    .checked_add(width)
                    .is_some_and(|end| end <= total)
            };
            if width >= AT_ONCE * L::COUNT && neighbours.iter().all(whole) {
                self.whole_row::<L>(r * width, neighbours);
            } else {
                self.any_row::<L>(r * width, neighbours);
            }
        }
    }
}

impl<T: Element, const D: usize, const M: usize> PlaneProduct<'_, T, D, M> {
    /// The neighbours of a row inside the grid, in the order of the sums.
    #[inline(always)]
    fn neighbours(&self, row: usize) -> ([Neighbours; MAX_NEIGHBOURS], usize) {
        let n = self.grid.nodes_per_axis();
        let width = n[0];
        let (j, k) = if D == 3 {
            (row % n[1], row / n[1])
        } else {
            (row, 0)
        };
        let start = row * width;
        let half = 3usize.pow(D as u32) / 2;
        let mut found = [Neighbours::default(); MAX_NEIGHBOURS];
        let mut count = 0;
        for code in half..=2 * half {
            let dx = (code % 3) as isize - 1;
            let dy = (code / 3 % 3) as isize - 1;
            let dz = if D == 3 { (code / 9) as isize - 1 } else { 0 };
            for sign in [1, -1] {
                if sign < 0 && code == half {
                    continue;
                }
                let (dx, dy, dz) = (sign * dx, sign * dy, sign * dz);
                let inside =
                    |i: usize, d: isize, n: usize| i.checked_add_signed(d).is_some_and(|i| i < n);
                if !inside(j, dy, n[1]) || (D == 3 && !inside(k, dz, n[D - 1])) {
                    continue;
                }
                let shift = (dz * n[1] as isize + dy) * width as isize;
                let neighbour = start.wrapping_add_signed(shift + dx);
                found[count] = Neighbours {
                    array: code - half,
                    forward: sign > 0,
                    block: if sign > 0 { start } else { neighbour },
                    neighbour,
                    from: usize::from(dx < 0),
                    to: width - usize::from(dx > 0),
                };
                count += 1;
            }
        }
        (found, count)
    }

    /// The array of the entry of the blocks that takes component `s` of neighbours to component `r`.
    #[inline(always)]
    fn entry(of: &Neighbours, r: usize, s: usize) -> usize {
        of.array * M * M + if of.forward { r * M + s } else { s * M + r }
    }

    /// A row whose neighbours are all in memory, also where they are those of another row. The last
    /// registers overlap those before them, and hold the same numbers.
    #[inline(always)]
    fn whole_row<L: Lane<Element = f64>>(&mut self, at: usize, neighbours: &[Neighbours]) {
        let (total, width) = (self.grid.n_nodes(), self.grid.nodes_per_axis()[0]);
        let run = AT_ONCE * L::COUNT;
        for first in (0..width).step_by(run) {
            let first = first.min(width - run);
            let mut sums = [[L::zero(); AT_ONCE]; M];
            for of in neighbours {
                for s in 0..M {
                    let x = &self.x[s * total + of.neighbour + first..][..run];
                    for r in 0..M {
                        let a = Self::entry(of, r, s) * total + of.block + first;
                        let a = &self.coupling[a..][..run];
                        for (k, sum) in sums[r].iter_mut().enumerate() {
                            let lanes = k * L::COUNT..(k + 1) * L::COUNT;
                            let a = load::<L, T>(&a[lanes.clone()]);
                            *sum = a.mul_add(L::load(&x[lanes]), *sum);
                        }
                    }
                }
            }
            for (out, sums) in self.out.iter_mut().zip(sums) {
                for (out, sum) in out[at + first..][..run]
                    .chunks_exact_mut(L::COUNT)
                    .zip(sums)
                {
                    sum.store(out);
                }
            }
        }
    }

    /// Any row; the sums are those of [`whole_row`](Self::whole_row), bit for bit.
    #[inline(always)]
    fn any_row<L: Lane<Element = f64>>(&mut self, at: usize, neighbours: &[Neighbours]) {
        let (total, width) = (self.grid.n_nodes(), self.grid.nodes_per_axis()[0]);
        for (r, out) in self.out.iter_mut().enumerate() {
            let out = &mut out[at..at + width];
            out.fill(0.0);
            for of in neighbours {
                let (block, neighbour) = (
                    of.block.wrapping_add(of.from),
                    of.neighbour.wrapping_add(of.from),
                );
                for s in 0..M {
                    let length = of.to - of.from;
                    let a = &self.coupling[Self::entry(of, r, s) * total + block..][..length];
                    let x = &self.x[s * total + neighbour..][..length];
                    multiply_add::<L, T>(a, x, &mut out[of.from..of.to]);
                }
            }
        }
    }
}

/// A register of couplings.
#[inline(always)]
fn load<L: Lane<Element = f64>, T: Element>(a: &[T]) -> L {
    match T::numbers(a) {
        Numbers::Double(a) => L::load(a),
        Numbers::Single(a) => L::load_singles(a),
    }
}

/// `out += a x`, entry by entry.
#[inline(always)]
fn multiply_add<L: Lane<Element = f64>, T: Element>(a: &[T], x: &[f64], out: &mut [f64]) {
    let mut i = 0;
    while i < out.len() {
        let a = load::<L, T>(&a[i..]);
        let sum = a.mul_add(L::load(&x[i..]), L::load(&out[i..]));
        sum.store(&mut out[i..]);
        i += L::COUNT;
    }
}

/// Terms added to the matrix and to the right-hand side besides the scattered points: the element
/// matrix of a constant operator and a constant load.
#[derive(Clone, Copy, Default)]
pub struct Background {
    /// Coefficient of the mass matrix `M`.
    pub mass: f64,
    /// Coefficient of the stiffness matrix `L`.
    pub stiffness: f64,
    /// Constant density of the load: `load * M 1` is added to the right-hand side.
    pub load: f64,
}

/// Element matrix of `mass M + stiffness L`.
pub(crate) fn constant_element<const D: usize>(
    grid: &Grid<D>,
    background: Background,
) -> [[f64; MAX_CORNERS]; MAX_CORNERS] {
    let weight = grid.cell_volume() / f64::from(1u32 << D);
    let inverse_h2 = grid.spacing().powi(-2);
    let mut element = [[0.0; MAX_CORNERS]; MAX_CORNERS];
    for a in 0..1 << D {
        for b in 0..1 << D {
            for q in 0..1 << D {
                let mass = shape_value::<D>(a, q, GAUSS) * shape_value::<D>(b, q, GAUSS);
                let stiffness: f64 = (0..D)
                    .map(|k| {
                        shape_derivative::<D>(a, q, k, GAUSS)
                            * shape_derivative::<D>(b, q, k, GAUSS)
                    })
                    .sum();
                element[a][b] += weight
                    * (background.mass * mass + background.stiffness * inverse_h2 * stiffness);
            }
        }
    }
    element
}
