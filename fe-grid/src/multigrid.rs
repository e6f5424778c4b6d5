//! Symmetric geometric multigrid for quadratic laws with coefficients per cell.
//!
//! The operator on every level is the Hessian action of one quadratic [`CellLaw`], applied by
//! the cell engine; the coefficients of a coarse cell are computed from those of its `2^D` children
//! ([`CoefficientLaw::coarsen`]). Since the spaces are nested, this is close to the Galerkin
//! product, with a few numbers per cell. The smoother is a Chebyshev polynomial of the operator
//! preconditioned by its block diagonal, the same before and after the coarse-grid correction, so
//! that the cycle is a symmetric operator and can be used as a preconditioner of conjugate
//! gradients or as a metric. Single precision suffices in a preconditioner and halves its memory.

use crate::blocks::{invert_blocks, rounding_error};
use crate::covering::{continued_cells, covering, prolong_from, restrict_to};
use crate::engine::{Assembly, CellLaw, Data, MAX_CELL_DATA};
use crate::error::GridError;
use crate::grid::Grid;
use crate::lane::{Element, Lane, LaneKernel};
use crate::linear::LinearOperator;
use crate::parallel;
use crate::pool::Pool;
use crate::transfer::average_cells;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::sync::Arc;

/// A quadratic law with coefficients that are constant on each cell.
pub trait CoefficientLaw<const D: usize, const M: usize>: CellLaw<D, M> + Clone {
    /// Computes the coefficients of a coarse cell from their means over its children.
    fn coarsen(&self, means: &mut [f64; MAX_CELL_DATA]);

    /// Returns an upper bound of the spectrum of the operator preconditioned by its block diagonal,
    /// from the coefficients of all cells; `None` if it has to be estimated. An estimate that is
    /// too low, which is possible where a coefficient nearly vanishes in a few cells, makes the
    /// cycle indefinite.
    fn spectral_bound<T: Element>(&self, spacing: f64, cells: &[Vec<T>]) -> Option<f64> {
        let _ = (spacing, cells);
        None
    }
}

/// Parameters of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultigridParams {
    /// Degree of the smoothing polynomial before the coarse-grid correction, and of that after it.
    pub smoothing_steps: usize,
    /// Lower end of the part of the spectrum that the smoother damps, as a fraction of the upper
    /// end.
    pub smoothing_range: f64,
    /// Maximal number of unknowns of the coarsest level, which is solved directly.
    pub direct_unknowns: usize,
}

impl Default for MultigridParams {
    fn default() -> Self {
        Self {
            smoothing_steps: 2,
            smoothing_range: 0.25,
            direct_unknowns: 100,
        }
    }
}

/// Levels with at most so many unknowns are factorised where a number of cells is odd: the coarse grid,
/// which then reaches beyond the box, is a worse approximation, and costs no less.
const ODD_UNKNOWNS: usize = 600;

/// Levels with more unknowns use the upper end of the spectrum of the next coarser level. It
/// depends on the element: refinement does not change it, and jumps of the coefficients hardly do.
const SPECTRUM_UNKNOWNS: usize = 150_000;

struct Level<T, F, const D: usize, const M: usize> {
    grid: Grid<D>,
    law: F,
    cells: Vec<Vec<T>>,
    /// Inverses of the diagonal blocks, `[r M + m][node]`.
    inverse_blocks: Vec<T>,
    /// Upper end of the spectrum of the operator preconditioned by its block diagonal.
    spectral_bound: f64,
}

/// Vectors of one level.
struct Scratch<T> {
    x: Vec<T>,
    b: Vec<T>,
    residual: Vec<T>,
    update: Vec<T>,
    product: Vec<T>,
}

/// Work vectors of cycles. Cycles on the same grid can share them: there are as many sets as cycles
/// that run at the same time.
#[derive(Clone)]
pub struct WorkSpace<T>(Arc<Pool<Vec<Scratch<T>>>>);

impl<T> Default for WorkSpace<T> {
    fn default() -> Self {
        Self(Arc::new(Pool::new()))
    }
}

/// One V-cycle with initial guess zero, as a linear operator: an approximate inverse.
pub struct Multigrid<T: Element, F, const D: usize, const M: usize> {
    /// Levels, finest first.
    levels: Vec<Level<T, F, D, M>>,
    direct: Cholesky<f64, Dyn>,
    params: MultigridParams,
    work_space: WorkSpace<T>,
}

impl<T, F, const D: usize, const M: usize> Level<T, F, D, M>
where
    T: Element,
    F: CoefficientLaw<D, M>,
{
    fn new(grid: Grid<D>, law: F, cells: Vec<Vec<T>>) -> Self {
        Self {
            grid,
            law,
            cells,
            inverse_blocks: Vec::new(),
            spectral_bound: 0.0,
        }
    }

    fn n_unknowns(&self) -> usize {
        M * self.grid.n_nodes()
    }

    /// The law does not depend on the state; the direction is passed for it.
    fn apply_into(&self, x: &[T], y: &mut [T]) {
        let cells: Vec<&[T]> = self.cells.iter().map(Vec::as_slice).collect();
        let data = Data {
            coefficients: &[],
            cells: &cells,
        };
        Assembly::new(self.grid, &self.law, data).hessian_action_into(x, x, y);
    }

    /// The level of twice the spacing; `None` if this one is small enough to be factorised.
    fn coarser(&self) -> Option<Self> {
        let large = self.n_unknowns() > ODD_UNKNOWNS;
        let even = self.grid.coarser();
        let grid = even.or_else(|| large.then(|| covering(&self.grid))?)?;
        let mut cells: Vec<Vec<T>> = self
            .cells
            .iter()
            .map(|data| average_cells(&grid, &continued_cells(&self.grid, &grid, data)))
            .collect();
        for i in 0..grid.n_cells() {
            let mut means = [0.0; MAX_CELL_DATA];
            for (mean, data) in means.iter_mut().zip(&cells) {
                *mean = data[i].to_f64();
            }
            self.law.coarsen(&mut means);
            for (data, mean) in cells.iter_mut().zip(means) {
                data[i] = T::from_f64(mean);
            }
        }
        Some(Self::new(grid, self.law.clone(), cells))
    }

    /// Inverts the diagonal blocks.
    fn invert_blocks(&mut self) -> Result<(), GridError> {
        let n = self.grid.n_nodes();
        let mut blocks = vec![T::default(); M * M * n];
        let cells: Vec<&[T]> = self.cells.iter().map(Vec::as_slice).collect();
        let data = Data {
            coefficients: &[],
            cells: &cells,
        };
        let zero = vec![T::default(); M * n];
        Assembly::new(self.grid, &self.law, data).block_diagonal_into(&zero, &mut blocks);
        invert_blocks::<T, M>(&mut blocks)?;
        self.inverse_blocks = blocks;
        Ok(())
    }

    /// Power iteration from a fixed oscillating vector, with a safety factor, as it converges from
    /// below.
    fn estimate_spectrum(&self) -> f64 {
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
    fn precondition_into(&self, x: &[T], y: &mut [T]) {
        let n = self.grid.n_nodes();
        for (r, row) in y.chunks_exact_mut(n).enumerate() {
            parallel::for_each_chunk(row, CHUNK, MIN_CHUNKS, &|chunk, out| {
                let start = chunk * CHUNK;
                let blocks = &self.inverse_blocks[r * M * n..(r + 1) * M * n];
                T::run_kernel(BlockRow::<T, M> {
                    blocks,
                    x,
                    start,
                    out,
                });
            });
        }
    }

    fn update_residual(&self, s: &mut Scratch<T>) {
        self.apply_into(&s.x, &mut s.product);
        difference(&s.b, &s.product, &mut s.residual);
    }

    /// Improves `x`, given its residual `b - A x`, by a Chebyshev polynomial. `product` and
    /// `update` are work vectors; the residual is not updated at the end.
    fn smooth(&self, s: &mut Scratch<T>, params: &MultigridParams) {
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

impl<T, F, const D: usize, const M: usize> Multigrid<T, F, D, M>
where
    T: Element,
    F: CoefficientLaw<D, M>,
{
    /// Builds the levels for coefficients per cell on the finest grid.
    ///
    /// The number of cells along every axis is halved while that is possible and the level has more
    /// than [`MultigridParams::direct_unknowns`] unknowns; the last level is factorised as a dense
    /// matrix. Where a number of cells is odd and there are too many unknowns for that, the coarse grid
    /// reaches one cell of the fine grid beyond the box: the method is fastest on grids whose numbers of
    /// cells can be halved often.
    ///
    /// # Errors
    /// [`GridError::NotPositiveDefinite`] if the operator is not positive definite.
    ///
    /// # Panics
    /// If there are not as many coefficients as the law reads, or one has the wrong length.
    pub fn new(
        grid: Grid<D>,
        law: &F,
        cells: Vec<Vec<T>>,
        params: MultigridParams,
    ) -> Result<Self, GridError> {
        assert_eq!(cells.len(), F::CELL_DATA);
        let mut levels = vec![Level::new(grid, law.clone(), cells)];
        loop {
            let last = &levels[levels.len() - 1];
            if last.n_unknowns() <= params.direct_unknowns {
                break;
            }
            match last.coarser() {
                Some(coarse) => levels.push(coarse),
                None => break,
            }
        }
        // From the coarsest level on: large levels use the spectrum of the next coarser one.
        let mut bound = None;
        for level in levels.iter_mut().rev() {
            level.invert_blocks()?;
            let known = level.law.spectral_bound(level.grid.spacing(), &level.cells);
            level.spectral_bound = match (known, bound) {
                (Some(known), _) => known,
                (None, Some(bound)) if level.n_unknowns() > SPECTRUM_UNKNOWNS => bound,
                _ => level.estimate_spectrum(),
            };
            bound = Some(level.spectral_bound);
        }
        let direct = factorise(&levels[levels.len() - 1])?;
        Ok(Self {
            levels,
            direct,
            params,
            work_space: WorkSpace::default(),
        })
    }

    /// Sets work space that is shared with other cycles.
    pub fn with_work_space(mut self, work_space: WorkSpace<T>) -> Self {
        self.work_space = work_space;
        self
    }

    /// Applies the operator itself on the finest level, in the storage precision.
    pub fn operator_into(&self, x: &[T], y: &mut [T]) {
        self.levels[0].apply_into(x, y);
    }

    fn scratch(&self) -> Vec<Scratch<T>> {
        self.levels
            .iter()
            .map(|level| {
                let zeros = || vec![T::default(); level.n_unknowns()];
                Scratch {
                    x: zeros(),
                    b: zeros(),
                    residual: zeros(),
                    update: zeros(),
                    product: zeros(),
                }
            })
            .collect()
    }

    fn fits(&self, scratch: &[Scratch<T>]) -> bool {
        let sizes = self.levels.iter().map(Level::n_unknowns);
        scratch.iter().map(|s| s.x.len()).eq(sizes)
    }

    /// Computes `x` from `b` by one V-cycle on a level, with initial guess zero.
    fn cycle(&self, depth: usize, scratch: &mut [Scratch<T>]) {
        let level = &self.levels[depth];
        let (own, coarser) = scratch.split_at_mut(1);
        let s = &mut own[0];
        if depth + 1 == self.levels.len() {
            let b = DVector::from_iterator(s.b.len(), s.b.iter().map(|x| x.to_f64()));
            for (x, &y) in s.x.iter_mut().zip(self.direct.solve(&b).iter()) {
                *x = T::from_f64(y);
            }
            return;
        }
        s.x.fill(T::default());
        s.residual.copy_from_slice(&s.b);
        level.smooth(s, &self.params);
        level.update_residual(s);
        let coarse_grid = self.levels[depth + 1].grid;
        restrict_to(&level.grid, &coarse_grid, &s.residual, &mut coarser[0].b);
        self.cycle(depth + 1, coarser);
        prolong_from(&level.grid, &coarse_grid, &coarser[0].x, &mut s.update);
        add_into(&s.update, &mut s.x);
        level.update_residual(s);
        level.smooth(s, &self.params);
    }
}

impl<T, F, const D: usize, const M: usize> LinearOperator for Multigrid<T, F, D, M>
where
    T: Element,
    F: CoefficientLaw<D, M>,
{
    fn dim(&self) -> usize {
        self.levels[0].n_unknowns()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        // The right-hand side is scaled to one, so that single precision neither overflows nor
        // underflows.
        let largest = x.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if largest == 0.0 {
            y.fill(0.0);
            return;
        }
        self.work_space.0.with(
            || self.scratch(),
            |scratch| {
                // It may have the size of another grid.
                if !self.fits(scratch) {
                    *scratch = self.scratch();
                }
                for (b, v) in scratch[0].b.iter_mut().zip(x) {
                    *b = T::from_f64(v / largest);
                }
                self.cycle(0, scratch);
                for (y, v) in y.iter_mut().zip(&scratch[0].x) {
                    *y = v.to_f64() * largest;
                }
            },
        );
    }
}

/// Computes the product of one row of the diagonal blocks and a vector, for the nodes from `start`
/// on.
struct BlockRow<'a, T, const M: usize> {
    /// `[m][node]`.
    blocks: &'a [T],
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
            let part =
                |v: &[T], m: usize| L::load(&v[m * n + self.start + i..m * n + self.start + end]);
            let mut sum = part(self.blocks, 0) * part(self.x, 0);
            for m in 1..M {
                sum = part(self.blocks, m).mul_add(part(self.x, m), sum);
            }
            sum.store(&mut self.out[i..]);
            i += L::COUNT;
        }
    }
}

/// Assembles the coarsest operator column by column, and factorises it.
fn factorise<T, F, const D: usize, const M: usize>(
    level: &Level<T, F, D, M>,
) -> Result<Cholesky<f64, Dyn>, GridError>
where
    T: Element,
    F: CoefficientLaw<D, M>,
{
    let n = level.n_unknowns();
    let mut matrix = DMatrix::zeros(n, n);
    let (mut x, mut y) = (vec![T::default(); n], vec![T::default(); n]);
    for j in 0..n {
        x[j] = T::one();
        level.apply_into(&x, &mut y);
        x[j] = T::default();
        for i in 0..n {
            // The matrix is symmetric up to rounding in single precision.
            matrix[(i, j)] += 0.5 * y[i].to_f64();
            matrix[(j, i)] += 0.5 * y[i].to_f64();
        }
    }
    // A relative shift of the size of rounding errors keeps a nearly singular matrix positive
    // definite.
    let shift = 8.0 * rounding_error::<T>() * matrix.diagonal().max();
    for i in 0..n {
        matrix[(i, i)] += shift;
    }
    let curvature = matrix.diagonal().min();
    Cholesky::new(matrix).ok_or(GridError::NotPositiveDefinite {
        curvature,
        iteration: 0,
    })
}

/// Number of entries per task.
const CHUNK: usize = 4096;
/// Minimal number of tasks per thread.
const MIN_CHUNKS: usize = 4;

fn add_into<T: Element>(x: &[T], y: &mut [T]) {
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
