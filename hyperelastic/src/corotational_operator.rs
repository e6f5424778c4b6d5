//! The operator of a corotational form and one multigrid cycle on it. Their kernels are compiled here
//! for both dimensions, once.

use crate::corotational::Corotational;
use fe_grid::multigrid::{Multigrid, MultigridParams, WorkSpace};
use fe_grid::{
    Assembly, Data, Element, Grid, GridError, LinearOperator, Numbers, NumbersMut, compiled_once,
};

/// The operator of a [`Corotational`] form on the nodal displacements of a grid.
#[derive(Clone, Debug)]
pub struct CorotationalOperator<const D: usize> {
    grid: Grid<D>,
    law: Corotational<D>,
    cells: Vec<Vec<f64>>,
}

impl<const D: usize> CorotationalOperator<D> {
    /// The operator for data per cell.
    ///
    /// # Panics
    /// When it is applied, if there are not as many data as the form reads, or one has the wrong
    /// length.
    pub fn new(grid: Grid<D>, law: Corotational<D>, cells: Vec<Vec<f64>>) -> Self {
        Self { grid, law, cells }
    }
}

impl<const D: usize> LinearOperator for CorotationalOperator<D> {
    fn dim(&self) -> usize {
        D * self.grid.n_nodes()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        apply_operator(self, x, y);
    }
}

compiled_once! {
    /// `y = A x`.
    fn apply_operator<'a, D>(
        operator: &'a CorotationalOperator<D>,
        x: &'a [f64],
        y: &'a mut [f64],
    ) = apply_operator_in;
}

fn apply_operator_in<const D: usize>(operator: &CorotationalOperator<D>, x: &[f64], y: &mut [f64]) {
    let cells: Vec<&[f64]> = operator.cells.iter().map(Vec::as_slice).collect();
    let data = Data {
        coefficients: &[],
        cells: &cells,
    };
    // The form is quadratic: the state does not matter.
    Assembly::new(operator.grid, &operator.law, data).hessian_action_into(x, x, y);
}

/// Memory of a [`CorotationalMultigrid`] in bytes: known before it is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CycleMemory {
    /// The data of the cells of all levels, and the inverse diagonal blocks of their nodes.
    pub matrices: u64,
    /// Five vectors of every level, which cycles may [share](CorotationalMultigrid::with_work_space).
    pub work_space: u64,
}

impl CycleMemory {
    /// The memory with a finest grid, all numbers in single precision.
    pub fn on<const D: usize>(grid: &Grid<D>) -> Self {
        let single = size_of::<f32>() as u64;
        let (mut matrices, mut work_space) = (0, 0);
        let mut level = Some(*grid);
        while let Some(grid) = level {
            let (nodes, cells) = (grid.n_nodes(), grid.n_cells());
            matrices += single * (Corotational::<D>::CELL_DATA * cells + D * D * nodes) as u64;
            work_space += 5 * single * (D * nodes) as u64;
            level = grid.coarser();
        }
        Self {
            matrices,
            work_space,
        }
    }
}

/// One multigrid cycle on a [`Corotational`] form, as a linear operator: an approximate inverse.
pub struct CorotationalMultigrid<const D: usize>(Multigrid<f32, Corotational<D>, D, D>);

impl<const D: usize> CorotationalMultigrid<D> {
    /// Builds the levels for data per cell on the finest grid; see [`Multigrid::new`].
    ///
    /// # Errors
    /// [`GridError::NotPositiveDefinite`] where the form is not.
    ///
    /// # Panics
    /// If there are not as many data as the form reads, or one has the wrong length.
    pub fn new(
        grid: Grid<D>,
        law: Corotational<D>,
        cells: Vec<Vec<f32>>,
        params: MultigridParams,
    ) -> Result<Self, GridError> {
        new_cycle(grid, law, cells, params).map(Self)
    }

    /// The same with work space that is shared.
    pub fn with_work_space(self, work_space: WorkSpace<f32>) -> Self {
        Self(self.0.with_work_space(work_space))
    }

    /// Applies one cycle to a vector in either precision.
    pub fn apply_in<T: Element>(&self, x: &[T], y: &mut [T]) {
        apply_cycle(&self.0, T::numbers(x), T::numbers_mut(y));
    }
}

impl<const D: usize> LinearOperator for CorotationalMultigrid<D> {
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        self.apply_in(x, y);
    }
}

compiled_once! {
    /// The levels of a cycle.
    fn new_cycle<'a, D>(
        grid: Grid<D>,
        law: Corotational<D>,
        cells: Vec<Vec<f32>>,
        params: MultigridParams,
    ) -> Result<Multigrid<f32, Corotational<D>, D, D>, GridError> = new_cycle_in;
}

fn new_cycle_in<const D: usize>(
    grid: Grid<D>,
    law: Corotational<D>,
    cells: Vec<Vec<f32>>,
    params: MultigridParams,
) -> Result<Multigrid<f32, Corotational<D>, D, D>, GridError> {
    Multigrid::new(grid, &law, cells, params)
}

compiled_once! {
    /// One cycle.
    fn apply_cycle<'a, D>(
        cycle: &'a Multigrid<f32, Corotational<D>, D, D>,
        x: Numbers<'a>,
        y: NumbersMut<'a>,
    ) = apply_cycle_in;
}

fn apply_cycle_in<const D: usize>(
    cycle: &Multigrid<f32, Corotational<D>, D, D>,
    x: Numbers<'_>,
    y: NumbersMut<'_>,
) {
    match (x, y) {
        (Numbers::Double(x), NumbersMut::Double(y)) => cycle.apply_in(x, y),
        (Numbers::Double(x), NumbersMut::Single(y)) => cycle.apply_in(x, y),
        (Numbers::Single(x), NumbersMut::Double(y)) => cycle.apply_in(x, y),
        (Numbers::Single(x), NumbersMut::Single(y)) => cycle.apply_in(x, y),
    }
}
