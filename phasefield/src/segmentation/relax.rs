//! Solution of one of the two linear systems: minimises the energy in one field with the other
//! fixed.

use crate::error::PhaseFieldError;
use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::multigrid::{Multigrid, MultigridParams};
use fe_grid::operators::WeightedMassStiffness;
use fe_grid::{
    Assembly, CellLaw, CellProbe, CgParams, CgScratch, Data, Grid, GridError, Jet, Lane,
    LinearOperator, Point, Reads, compiled_once, conjugate_gradient, probe_cells, vector,
};
use std::sync::{Mutex, PoisonError};

/// A field of the pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The smoothed image `u`.
    Image = 0,
    /// The phase field `v`.
    PhaseField = 1,
}

/// Statistics of a relaxation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation {
    /// Energy before the relaxation.
    pub energy: f64,
    /// Number of conjugate-gradient iterations.
    pub iterations: usize,
}

/// Tolerance of a system: the reduction of the residual.
const SYSTEM_TOLERANCE: f64 = 1e-4;

/// Replaces one field of a state, `u` first and then `v`, by the minimiser of the energy with the
/// other fixed: a Newton step, as the energy is quadratic in either.
///
/// Applies to any density of two fields that is quadratic in each, and whose second derivative in
/// each is `m d^2 + s |grad d|^2` with numbers `m`, `s` at every point, such as
/// [`AmbrosioTortorelli`](super::AmbrosioTortorelli) with additional terms in `v`. The energy does
/// not increase.
///
/// # Errors
/// [`PhaseFieldError::Grid`] if the state is not finite or the system not definite.
///
/// # Panics
/// If the state does not fit the grid.
pub fn relax<F: CellLaw<D, 2>, const D: usize>(
    grid: &Grid<D>,
    law: &F,
    data: Data<'_, f64>,
    state: &mut [f64],
    part: Part,
) -> Result<Relaxation, PhaseFieldError> {
    let n = grid.n_nodes();
    let own = part as usize * n..(part as usize + 1) * n;
    let assembly = Assembly::new(*grid, law, data);
    let mut gradient = vec![0.0; 2 * n];
    let energy = assembly.value_and_gradient_into(state, &mut gradient)?;
    let mut rhs = gradient[own.clone()].to_vec();
    vector::scale(-1.0, &mut rhs);
    let probe = BlockProbe {
        law,
        part: part as usize,
    };
    let cells: Vec<Vec<f64>> = probe_cells(grid, &probe, data, state);
    let block = Block {
        assembly,
        state,
        part: part as usize,
        room: Mutex::new([vec![0.0; 2 * n], gradient]),
    };
    let mut step = vec![0.0; n];
    let iterations = solve(grid, cells, &block, &rhs, &mut step)?;
    vector::axpy(1.0, &step, &mut state[own]);
    Ok(Relaxation { energy, iterations })
}

compiled_once! {
    /// Solves one system, preconditioned by a multigrid cycle for the mass and stiffness of the
    /// cells, and gives the number of iterations.
    fn solve<'a, D>(
        grid: &'a Grid<D>,
        cells: Vec<Vec<f64>>,
        system: &'a dyn LinearOperator,
        rhs: &'a [f64],
        step: &'a mut [f64],
    ) -> Result<usize, GridError> = solve_in;
}

fn solve_in<const D: usize>(
    grid: &Grid<D>,
    cells: Vec<Vec<f64>>,
    system: &dyn LinearOperator,
    rhs: &[f64],
    step: &mut [f64],
) -> Result<usize, GridError> {
    let params = MultigridParams::default();
    let cycle = Multigrid::<_, _, D, 1>::new(*grid, &WeightedMassStiffness, cells, params)?;
    let params = CgParams {
        relative_tolerance: SYSTEM_TOLERANCE,
        ..CgParams::default()
    };
    let mut scratch = CgScratch::default();
    let info = conjugate_gradient(system, &cycle, rhs, step, &params, &mut scratch)?;
    Ok(info.iterations)
}

/// The second derivative with respect to one field.
struct Block<'a, F, const D: usize> {
    assembly: Assembly<'a, F, f64, D, 2>,
    state: &'a [f64],
    part: usize,
    /// Work arrays: a direction that is zero in the other field, and its image.
    room: Mutex<[Vec<f64>; 2]>,
}

impl<F: CellLaw<D, 2>, const D: usize> LinearOperator for Block<'_, F, D> {
    fn dim(&self) -> usize {
        self.assembly.grid().n_nodes()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        let own = self.part * x.len()..(self.part + 1) * x.len();
        let mut room = self.room.lock().unwrap_or_else(PoisonError::into_inner);
        let [direction, image] = &mut *room;
        direction[own.clone()].copy_from_slice(x);
        self.assembly
            .hessian_action_into(self.state, direction, image);
        y.copy_from_slice(&image[own]);
    }
}

/// The coefficients of mass and stiffness of a block, as means over cells: the second derivative
/// in a direction that is one, and in one whose gradient is.
struct BlockProbe<'a, F> {
    law: &'a F,
    part: usize,
}

impl<F: Reads> Reads for BlockProbe<'_, F> {
    const USES_VALUE: bool = F::USES_VALUE;
    const USES_GRADIENT: bool = F::USES_GRADIENT;
    const COEFFICIENTS: usize = F::COEFFICIENTS;
    const CELL_DATA: usize = F::CELL_DATA;
}

impl<F: CellLaw<D, 2>, const D: usize> CellProbe<D, 2> for BlockProbe<'_, F> {
    const OUTPUTS: usize = 2;

    #[inline(always)]
    fn probe<L: Lane>(&self, point: &Point<L, D, 2>) -> [L; MAX_CELL_DATA] {
        let mut out = [L::zero(); MAX_CELL_DATA];
        let mut direction = Jet::zero();
        direction.value[self.part] = L::one();
        out[0] = self.law.hessian_action(point, &direction).value[self.part];
        direction = Jet::zero();
        direction.gradient[self.part][0] = L::one();
        out[1] = self.law.hessian_action(point, &direction).gradient[self.part][0];
        out
    }
}
