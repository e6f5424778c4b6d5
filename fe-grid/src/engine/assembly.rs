//! The energy of a law on a grid: the three verbs that the rest of the program calls.

use super::kernel::{DIAGONAL, GRADIENT, HESSIAN, RowKernel, SlabResult, VALUE};
use super::slabs::over_slabs;
use super::{CellLaw, Data};
use crate::error::GridError;
use crate::grid::Grid;
use crate::half::Half;
use crate::lane::Element;
use crate::simd_level::SimdLevel;

/// Below this number of cells a call stays on its thread.
const PARALLEL_CELLS: usize = 4096;

/// Evaluates the energy of a law on a grid, its gradient and its Hessian action.
///
/// Nodal arrays are `M` components one after the other, `x` fastest. Derivatives are plain
/// derivatives with respect to nodal values; no mass matrix is applied.
///
/// `ANY_LEVEL` says that the instruction set was chosen, so that all of them have to be there.
#[derive(Clone, Copy)]
pub struct Assembly<
    'a,
    F,
    T: Element,
    const D: usize,
    const M: usize,
    const ANY_LEVEL: bool = false,
> {
    grid: Grid<D>,
    law: &'a F,
    data: Data<'a, T>,
    /// The data of the cells, where they are halves.
    halves: &'a [&'a [Half]],
    level: SimdLevel,
}

impl<'a, F, T, const D: usize, const M: usize> Assembly<'a, F, T, D, M>
where
    F: CellLaw<D, M>,
    T: Element,
{
    /// Binds a law to a grid and to the fields that it reads.
    ///
    /// # Panics
    /// If there are fewer coefficient fields or cell data than the law reads, or if one has the
    /// wrong length.
    pub fn new(grid: Grid<D>, law: &'a F, data: Data<'a, T>) -> Self {
        const { assert!(D == 2 || D == 3) };
        assert!(
            data.coefficients.len() >= F::COEFFICIENTS,
            "coefficient fields are missing"
        );
        assert!(data.cells.len() >= F::CELL_DATA, "cell data are missing");
        assert!(data.coefficients.iter().all(|c| c.len() == grid.n_nodes()));
        assert!(data.cells.iter().all(|c| c.len() == grid.n_cells()));
        Self {
            grid,
            law,
            data,
            halves: &[],
            level: SimdLevel::active(),
        }
    }

    /// Binds a law that reads no coefficient field to a grid and to data of the cells in halves.
    ///
    /// # Panics
    /// If there are fewer data than the law reads, or if one has the wrong length.
    pub fn with_halves(grid: Grid<D>, law: &'a F, halves: &'a [&'a [Half]]) -> Self {
        const { assert!((D == 2 || D == 3) && F::COEFFICIENTS == 0) };
        assert!(halves.len() >= F::CELL_DATA, "cell data are missing");
        assert!(halves.iter().all(|c| c.len() == grid.n_cells()));
        Self {
            grid,
            law,
            data: Data::default(),
            halves,
            level: SimdLevel::active(),
        }
    }

    /// The same on another instruction set.
    pub fn with_simd_level(self, level: SimdLevel) -> Assembly<'a, F, T, D, M, true> {
        let Self {
            grid,
            law,
            data,
            halves,
            ..
        } = self;
        Assembly {
            grid,
            law,
            data,
            halves,
            level,
        }
    }
}

impl<F, T, const D: usize, const M: usize, const ANY_LEVEL: bool>
    Assembly<'_, F, T, D, M, ANY_LEVEL>
where
    F: CellLaw<D, M>,
    T: Element,
{
    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// The energy of a state.
    ///
    /// # Errors
    /// [`GridError::Inadmissible`] where the density is not finite, with the first such cell in
    /// memory order.
    ///
    /// # Panics
    /// If the state does not have `M` numbers a node; so for all methods here.
    pub fn value(&self, state: &[T]) -> Result<f64, GridError> {
        let results = self.run::<VALUE>(state, &[], 1.0, &mut [], 0);
        self.total(&results)
    }

    /// The energy of a state, and its gradient written to `gradient`.
    ///
    /// # Errors
    /// [`GridError::Inadmissible`] where the density is not finite; the gradient is then
    /// meaningless.
    pub fn value_and_gradient_into(
        &self,
        state: &[T],
        gradient: &mut [T],
    ) -> Result<f64, GridError> {
        gradient.fill(T::default());
        self.value_and_gradient_add(state, 1.0, gradient)
    }

    /// The energy of a state; `factor` times its gradient is added to `gradient`.
    ///
    /// # Errors
    /// [`GridError::Inadmissible`] where the density is not finite; the gradient is then
    /// meaningless.
    pub fn value_and_gradient_add(
        &self,
        state: &[T],
        factor: f64,
        gradient: &mut [T],
    ) -> Result<f64, GridError> {
        let results = self.run::<GRADIENT>(state, &[], factor, gradient, M);
        self.total(&results)
    }

    /// The energy of a state; `factor` times its gradient is added to `gradient` unless that is
    /// empty.
    ///
    /// # Errors
    /// [`GridError::Inadmissible`] where the density is not finite; the gradient is then
    /// meaningless.
    pub fn value_or_gradient_add(
        &self,
        state: &[T],
        factor: f64,
        gradient: &mut [T],
    ) -> Result<f64, GridError> {
        if gradient.is_empty() {
            self.value(state)
        } else {
            self.value_and_gradient_add(state, factor, gradient)
        }
    }

    /// The Hessian at a state applied to a direction. Where the state is not admissible, the
    /// result is meaningless.
    pub fn hessian_action_into(&self, state: &[T], direction: &[T], out: &mut [T]) {
        assert_eq!(direction.len(), M * self.grid.n_nodes());
        out.fill(T::default());
        self.run::<HESSIAN>(state, direction, 1.0, out, M);
    }

    /// The diagonal of the Hessian in blocks of `M` x `M`, row by row: entry `(r, m)` of the
    /// block of node `i` stands at `(r M + m) n_nodes + i`.
    pub fn block_diagonal_into(&self, state: &[T], out: &mut [T]) {
        out.fill(T::default());
        self.run::<DIAGONAL>(state, &[], 1.0, out, M * M);
    }

    fn total(&self, results: &[SlabResult]) -> Result<f64, GridError> {
        if let Some(cell) = results.iter().find_map(|r| r.inadmissible) {
            return Err(GridError::Inadmissible { cell });
        }
        let weight = self.grid.cell_volume() / f64::from(1u32 << D);
        Ok(weight * results.iter().map(|r| r.sum).sum::<f64>())
    }

    fn run<const MODE: u8>(
        &self,
        state: &[T],
        direction: &[T],
        factor: f64,
        out: &mut [T],
        outputs: usize,
    ) -> Vec<SlabResult> {
        assert_eq!(state.len(), M * self.grid.n_nodes());
        let parallel = self.grid.n_cells() >= PARALLEL_CELLS;
        over_slabs(&self.grid, outputs, out, parallel, &|slab| {
            let kernel = RowKernel::<F, T, D, M, MODE> {
                grid: &self.grid,
                law: self.law,
                data: self.data,
                halves: self.halves,
                state,
                direction,
                factor,
                slab,
            };
            if ANY_LEVEL {
                T::dispatch(self.level, kernel)
            } else {
                T::run_kernel(kernel)
            }
        })
    }
}
