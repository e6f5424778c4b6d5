//! One level of a multigrid cycle: its operator, its smoother, and its vectors.

use super::CoefficientLaw;
use crate::blocks::invert_blocks;
use crate::covering::{continued_cells, covering};
use crate::engine::{Assembly, Data, MAX_CELL_DATA};
use crate::error::GridError;
use crate::grid::Grid;
use crate::half::Half;
use crate::kept::Kept;
use crate::lane::{Element, Lane, LaneKernel};
use crate::multigrid::MultigridParams;
use crate::parallel;
use crate::transfer::average_cells;

/// Levels with at most so many unknowns are factorised where a number of cells is odd: the coarse grid,
/// which then reaches beyond the box, is a worse approximation, and costs no less.
const ODD_UNKNOWNS: usize = 600;

pub(super) struct Level<T, F, const D: usize, const M: usize> {
    pub grid: Grid<D>,
    pub law: F,
    pub cells: Vec<Kept<T>>,
    /// Inverses of the diagonal blocks: the entries of all nodes, one entry after the other.
    pub inverse_blocks: Vec<T>,
    /// Whether the entries are those of the upper triangle.
    pub upper: bool,
    /// Upper end of the spectrum of the operator preconditioned by its block diagonal.
    pub spectral_bound: f64,
}

/// Vectors of one level.
pub(super) struct Scratch<T> {
    pub x: Vec<T>,
    pub b: Vec<T>,
    pub residual: Vec<T>,
    pub update: Vec<T>,
    pub product: Vec<T>,
}

impl<T, F, const D: usize, const M: usize> Level<T, F, D, M>
where
    T: Element,
    F: CoefficientLaw<D, M>,
{
    pub fn new(grid: Grid<D>, law: F, cells: Vec<Vec<T>>) -> Self {
        Self {
            grid,
            law,
            cells: cells.into_iter().map(Kept::Whole).collect(),
            inverse_blocks: Vec::new(),
            upper: false,
            spectral_bound: 0.0,
        }
    }

    /// Keeps the coefficients in halves, and of the blocks the upper triangle.
    pub fn pack(&mut self) {
        let mut cells: Vec<_> = self.cells.iter_mut().map(Kept::take).collect();
        for i in 0..self.grid.n_cells() {
            self.change_coefficients(&mut cells, i, F::pack);
        }
        self.cells = cells
            .into_iter()
            .map(|data| Kept::in_halves(&data))
            .collect();
        self.law = self.law.packed();
        self.upper = true;
    }

    /// Changes the coefficients of a cell.
    pub fn change_coefficients(
        &self,
        cells: &mut [Vec<T>],
        cell: usize,
        change: impl FnOnce(&F, &mut [f64; MAX_CELL_DATA]),
    ) {
        let mut numbers = [0.0; MAX_CELL_DATA];
        for (number, data) in numbers.iter_mut().zip(&*cells) {
            *number = data[cell].to_f64();
        }
        change(&self.law, &mut numbers);
        for (data, number) in cells.iter_mut().zip(numbers) {
            data[cell] = T::from_f64(number);
        }
    }

    pub fn n_unknowns(&self) -> usize {
        M * self.grid.n_nodes()
    }

    /// The law does not depend on the state; the direction is passed for it.
    pub fn apply_into(&self, x: &[T], y: &mut [T]) {
        self.with_operator(|operator| operator.hessian_action_into(x, x, y));
    }

    pub fn with_operator(&self, work: impl FnOnce(Assembly<'_, F, T, D, M>)) {
        let (mut cells, mut halves): (Vec<&[T]>, Vec<&[Half]>) = (Vec::new(), Vec::new());
        for data in &self.cells {
            match data {
                Kept::Whole(data) => cells.push(data),
                Kept::Halves(data) => halves.push(data),
            }
        }
        let data = Data {
            coefficients: &[],
            cells: &cells,
        };
        work(if cells.is_empty() {
            Assembly::with_halves(self.grid, &self.law, &halves)
        } else {
            Assembly::new(self.grid, &self.law, data)
        });
    }

    /// The level of twice the spacing; `None` if this one is small enough to be factorised.
    pub fn coarser(&self) -> Option<Self> {
        let large = self.n_unknowns() > ODD_UNKNOWNS;
        let even = self.grid.coarser();
        let grid = even.or_else(|| large.then(|| covering(&self.grid))?)?;
        let mut cells: Vec<Vec<T>> = self
            .cells
            .iter()
            .map(|data| average_cells(&grid, &continued_cells(&self.grid, &grid, &data.numbers())))
            .collect();
        for i in 0..grid.n_cells() {
            self.change_coefficients(&mut cells, i, F::coarsen);
        }
        Some(Self::new(grid, self.law.clone(), cells))
    }

    /// Inverts the diagonal blocks.
    pub fn invert_blocks(&mut self) -> Result<(), GridError> {
        let n = self.grid.n_nodes();
        let mut blocks = vec![T::default(); M * M * n];
        let zero = vec![T::default(); M * n];
        self.with_operator(|operator| operator.block_diagonal_into(&zero, &mut blocks));
        drop(zero);
        invert_blocks::<T, M>(&mut blocks)?;
        if self.upper {
            for r in 0..M {
                for m in r..M {
                    let from = (r * M + m) * n;
                    blocks.copy_within(from..from + n, self.entry(r, m) * n);
                }
            }
            blocks.truncate(M * (M + 1) / 2 * n);
            blocks.shrink_to_fit();
        }
        self.inverse_blocks = blocks;
        Ok(())
    }

    /// The upper end of the spectrum, if the law knows it.
    pub fn known_bound(&self) -> Option<f64> {
        let cells: Vec<_> = self.cells.iter().map(Kept::numbers).collect();
        self.law.spectral_bound(self.grid.spacing(), &cells)
    }

    /// Power iteration from a fixed oscillating vector, with a safety factor, as it converges from
    /// below.
    pub fn estimate_spectrum(&self) -> f64 {
        const ITERATIONS: usize = 8;
        const MARGIN: f64 = 1.1;
        let n = self.n_unknowns();
        let wave = |i: usize| ((i * 7919) % 1013) as f64 / 506.0 - 1.0;
        let mut x: Vec<T> = (0..n).map(|i| T::from_f64(wave(i))).collect();
        let (mut y, mut z) = (vec![T::default(); n], vec![T::default(); n]);
        let mut bound: f64 = 1.0;
        for _ in 0..ITERATIONS {
            self.apply_into(&x, &mut y);
            self.precondition_into(&y, &mut z);
            // The Rayleigh quotient in the metric of the diagonal is <x, A x> / <x, D x>, but the
            // ratio of norms has the same limit and needs no further product.
            let norm = |v: &[T]| {
                v.iter()
                    .map(|a| a.to_f64() * a.to_f64())
                    .sum::<f64>()
                    .sqrt()
            };
            bound = norm(&z) / norm(&x).max(f64::MIN_POSITIVE);
            let scale = T::from_f64(1.0 / norm(&z).max(f64::MIN_POSITIVE));
            for (x, &z) in x.iter_mut().zip(&z) {
                *x = z * scale;
            }
        }
        MARGIN * bound
    }

    /// `y = D^{-1} x` with the diagonal blocks.
    pub fn precondition_into(&self, x: &[T], y: &mut [T]) {
        let n = self.grid.n_nodes();
        for (r, row) in y.chunks_exact_mut(n).enumerate() {
            parallel::for_each_chunk(row, CHUNK, MIN_CHUNKS, &|chunk, out| {
                let start = chunk * CHUNK;
                let blocks = std::array::from_fn(|m| {
                    let first = self.entry(r, m) * n + start;
                    &self.inverse_blocks[first..first + out.len()]
                });
                T::run_kernel(BlockRow::<T, M> {
                    blocks,
                    x,
                    start,
                    out,
                });
            });
        }
    }

    /// The place of an entry among those of the blocks.
    pub fn entry(&self, r: usize, m: usize) -> usize {
        if !self.upper {
            return r * M + m;
        }
        let (r, m) = (r.min(m), r.max(m));
        // The rows before have `M`, `M - 1`, ... entries.
        r * M + m - r * (r + 1) / 2
    }

    pub fn update_residual(&self, s: &mut Scratch<T>) {
        self.apply_into(&s.x, &mut s.product);
        difference(&s.b, &s.product, &mut s.residual);
    }

    /// Improves `x`, given its residual `b - A x`, by a Chebyshev polynomial. `product` and
    /// `update` are work vectors; the residual is not updated at the end.
    pub fn smooth(&self, s: &mut Scratch<T>, params: &MultigridParams) {
        let (low, high) = (
            params.smoothing_range * self.spectral_bound,
            self.spectral_bound,
        );
        let (centre, radius) = (f64::midpoint(high, low), 0.5 * (high - low));
        let sigma = centre / radius;
        let mut rho = 1.0 / sigma;
        self.precondition_into(&s.residual, &mut s.update);
        scale(&mut s.update, T::from_f64(1.0 / centre));
        for step in 1..=params.smoothing_steps {
            add_into(&s.update, &mut s.x);
            if step == params.smoothing_steps {
                break;
            }
            self.apply_into(&s.update, &mut s.product);
            subtract_from(&s.product, &mut s.residual);
            self.precondition_into(&s.residual, &mut s.product);
            let next = 1.0 / (2.0 * sigma - rho);
            let (keep, step) = (T::from_f64(next * rho), T::from_f64(2.0 * next / radius));
            combine(&mut s.update, keep, &s.product, step);
            rho = next;
        }
    }
}

/// Computes the product of one row of the diagonal blocks and a vector, for the nodes from `start`
/// on.
struct BlockRow<'a, T, const M: usize> {
    /// The entries of the row at those nodes.
    blocks: [&'a [T]; M],
    /// `[m][node]`.
    x: &'a [T],
    start: usize,
    out: &'a mut [T],
}

impl<T: Element, const M: usize> LaneKernel<T> for BlockRow<'_, T, M> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) {
        let n = self.x.len() / M;
        let end = self.out.len();
        let mut i = 0;
        while i < end {
            let x = |m: usize| L::load(&self.x[m * n + self.start + i..m * n + self.start + end]);
            let mut sum = L::load(&self.blocks[0][i..]) * x(0);
            for m in 1..M {
                sum = L::load(&self.blocks[m][i..]).mul_add(x(m), sum);
            }
            sum.store(&mut self.out[i..]);
            i += L::COUNT;
        }
    }
}

/// Number of entries per task.
const CHUNK: usize = 4096;
/// Minimal number of tasks per thread.
const MIN_CHUNKS: usize = 4;

pub(super) fn add_into<T: Element>(x: &[T], y: &mut [T]) {
    zip(x, y, |x, y| *y += x);
}

fn subtract_from<T: Element>(x: &[T], y: &mut [T]) {
    zip(x, y, |x, y| *y -= x);
}

/// `z = x - y`.
fn difference<T: Element>(x: &[T], y: &[T], z: &mut [T]) {
    parallel::for_each_chunk(z, CHUNK, MIN_CHUNKS, &|chunk, z| {
        let (x, y) = (&x[chunk * CHUNK..], &y[chunk * CHUNK..]);
        for (z, (&x, &y)) in z.iter_mut().zip(x.iter().zip(y)) {
            *z = x - y;
        }
    });
}

/// Computes `y = keep y + step x`.
fn combine<T: Element>(y: &mut [T], keep: T, x: &[T], step: T) {
    zip(x, y, |x, y| *y = *y * keep + x * step);
}

fn zip<T: Element>(x: &[T], y: &mut [T], f: impl Fn(T, &mut T) + Sync) {
    parallel::for_each_chunk(y, CHUNK, MIN_CHUNKS, &|chunk, y| {
        for (y, &x) in y.iter_mut().zip(&x[chunk * CHUNK..]) {
            f(x, y);
        }
    });
}

fn scale<T: Element>(x: &mut [T], s: T) {
    parallel::for_each_chunk(x, CHUNK, MIN_CHUNKS, &|_, x| {
        for x in x {
            *x *= s;
        }
    });
}
