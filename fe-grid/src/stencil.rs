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

/// `y = A x` for couplings as [`BlockStencil`] stores them.
fn multiply<T: Element, const D: usize, const M: usize>(
    grid: &Grid<D>,
    coupling: &[T],
    x: &[f64],
    y: &mut [f64],
) {
    let (n, total) = (grid.nodes_per_axis(), grid.n_nodes());
    let plane = if D == 3 { n[0] * n[1] } else { 16 * n[0] };
    for (component, y) in y.chunks_exact_mut(total).enumerate() {
        let work = |p: usize, out: &mut [f64]| {
            let first_row = p * plane / n[0];
            for (r, out) in out.chunks_exact_mut(n[0]).enumerate() {
                let kernel = RowProduct::<T, D, M> {
                    grid,
                    coupling,
                    x,
                    component,
                    row: first_row + r,
                    out,
                };
                <f64 as crate::Element>::run_kernel(kernel);
            }
        };
        let min_len = if total < PARALLEL_NODES { total } else { 1 };
        parallel::for_each_chunk(y, plane, min_len, &work);
    }
}

/// One row of nodes of one component of the product.
struct RowProduct<'a, T, const D: usize, const M: usize> {
    grid: &'a Grid<D>,
    coupling: &'a [T],
    x: &'a [f64],
    component: usize,
    row: usize,
    out: &'a mut [f64],
}

impl<T: Element, const D: usize, const M: usize> LaneKernel<f64> for RowProduct<'_, T, D, M> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) {
        let n = self.grid.nodes_per_axis();
        let total = self.grid.n_nodes();
        let width = n[0];
        let (j, k) = if D == 3 {
            (self.row % n[1], self.row / n[1])
        } else {
            (self.row, 0)
        };
        let start = self.row * width;
        self.out.fill(0.0);
        let half = 3usize.pow(D as u32) / 2;
        for code in 0..=half {
            let code = half + code;
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
                let other = start.wrapping_add_signed(shift);
                // Nodes of the row whose neighbour along x exists.
                let from = usize::from(dx < 0);
                let to = width - usize::from(dx > 0);
                let neighbour = other.wrapping_add_signed(dx).wrapping_add(from);
                for s in 0..M {
                    // Of the earlier of two nodes the block is stored; the later has its transpose.
                    let (entry, first) = if sign > 0 {
                        (self.component * M + s, start + from)
                    } else {
                        (s * M + self.component, neighbour)
                    };
                    let array = (code - half) * M * M + entry;
                    let a = &self.coupling[array * total + first..][..to - from];
                    let x = &self.x[s * total + neighbour..][..to - from];
                    multiply_add::<L, T>(a, x, &mut self.out[from..to]);
                }
            }
        }
    }
}

/// `out += a x`, entry by entry.
#[inline(always)]
fn multiply_add<L: Lane<Element = f64>, T: Element>(a: &[T], x: &[f64], out: &mut [f64]) {
    let mut i = 0;
    while i < out.len() {
        let a = match T::numbers(&a[i..]) {
            Numbers::Double(a) => L::load(a),
            Numbers::Single(a) => L::load_singles(a),
        };
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
