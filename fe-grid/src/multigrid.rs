//! Symmetric geometric multigrid for quadratic laws with coefficients per cell.
//!
//! The operator on every level is the Hessian action of one quadratic [`CellLaw`], applied by
//! the cell engine; the coefficients of a coarse cell are computed from those of its `2^D` children
//! ([`CoefficientLaw::coarsen`]). Since the spaces are nested, this is close to the Galerkin
//! product, with a few numbers per cell. The smoother is a Chebyshev polynomial of the operator
//! preconditioned by its block diagonal, the same before and after the coarse-grid correction, so
//! that the cycle is a symmetric operator and can be used as a preconditioner of conjugate
//! gradients or as a metric. Single precision suffices in a preconditioner and halves its memory.

mod level;

use crate::blocks::rounding_error;
use crate::covering::{prolong_from, restrict_to};
use crate::engine::{CellLaw, MAX_CELL_DATA};
use crate::error::GridError;
use crate::grid::Grid;
use crate::lane::Element;
use crate::linear::LinearOperator;
use crate::pool::Pool;
use level::{Level, Scratch, add_into};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::borrow::Cow;
use std::sync::Arc;

/// A quadratic law with coefficients that are constant on each cell.
pub trait CoefficientLaw<const D: usize, const M: usize>: CellLaw<D, M> + Clone {
    /// Computes the coefficients of a coarse cell from their means over its children.
    fn coarsen(&self, means: &mut [f64; MAX_CELL_DATA]);

    /// Changes the coefficients of a cell to those that [`Self::packed`] reads.
    fn pack(&self, coefficients: &mut [f64; MAX_CELL_DATA]) {
        let _ = coefficients;
    }

    /// Returns the law of coefficients that are kept in [halves](crate::Half): one that is positive whatever
    /// their rounding. The default is the law itself.
    #[must_use]
    fn packed(&self) -> Self {
        self.clone()
    }

    /// Returns an upper bound of the spectrum of the operator preconditioned by its block diagonal,
    /// from the coefficients of all cells; `None` if it has to be estimated. An estimate that is
    /// too low, which is possible where a coefficient nearly vanishes in a few cells, makes the
    /// cycle indefinite.
    fn spectral_bound<T: Element>(&self, spacing: f64, cells: &[Cow<'_, [T]>]) -> Option<f64> {
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
    /// Whether the coefficients are kept in [halves](crate::Half), and of the diagonal blocks the upper
    /// triangle.
    pub in_halves: bool,
}

impl Default for MultigridParams {
    fn default() -> Self {
        Self {
            smoothing_steps: 2,
            smoothing_range: 0.25,
            direct_unknowns: 100,
            in_halves: false,
        }
    }
}

/// Levels with more unknowns use the upper end of the spectrum of the next coarser level. It
/// depends on the element: refinement does not change it, and jumps of the coefficients hardly do.
const SPECTRUM_UNKNOWNS: usize = 150_000;

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
            let place = levels.len() - 1;
            let last = &levels[place];
            let small = last.n_unknowns() <= params.direct_unknowns;
            let coarser = if small { None } else { last.coarser() };
            if params.in_halves {
                levels[place].pack();
            }
            match coarser {
                Some(coarser) => levels.push(coarser),
                None => break,
            }
        }
        // From the coarsest level on: large levels use the spectrum of the next coarser one.
        let mut bound = None;
        for level in levels.iter_mut().rev() {
            level.invert_blocks()?;
            let known = level.known_bound();
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
        self.apply_in(x, y);
    }
}

impl<T, F, const D: usize, const M: usize> Multigrid<T, F, D, M>
where
    T: Element,
    F: CoefficientLaw<D, M>,
{
    /// Applies one cycle to a vector in any precision.
    pub fn apply_in<X: Element, Y: Element>(&self, x: &[X], y: &mut [Y]) {
        // The right-hand side is scaled to one, so that single precision neither overflows nor
        // underflows.
        let largest = x.iter().fold(0.0f64, |m, v| m.max(v.to_f64().abs()));
        if largest == 0.0 {
            y.fill(Y::default());
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
                    *b = T::from_f64(v.to_f64() / largest);
                }
                self.cycle(0, scratch);
                for (y, v) in y.iter_mut().zip(&scratch[0].x) {
                    *y = Y::from_f64(v.to_f64() * largest);
                }
            },
        );
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
