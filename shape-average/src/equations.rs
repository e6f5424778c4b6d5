//! The solution of the normal equations for the average.

use fe_grid::scatter::NormalEquations;
use fe_grid::{CgParams, CgScratch, Diagonal, GridError, compiled_once, conjugate_gradient};

compiled_once! {
    /// Solves the normal equations for a load, from an initial guess; returns the number of iterations.
    pub(crate) fn solve_equations<'a, D>(
        equations: &'a NormalEquations<D>,
        load: &'a [f64],
        solution: &'a mut [f64],
        relative_tolerance: f64,
        scratch: &'a mut CgScratch,
    ) -> Result<usize, GridError> = solve_equations_in;
}

fn solve_equations_in<const D: usize>(
    equations: &NormalEquations<D>,
    load: &[f64],
    solution: &mut [f64],
    relative_tolerance: f64,
    scratch: &mut CgScratch,
) -> Result<usize, GridError> {
    let matrix = equations.matrix();
    let jacobi = Diagonal::jacobi(&matrix.diagonal())?;
    let params = CgParams {
        relative_tolerance,
        ..CgParams::default()
    };
    let info = conjugate_gradient(matrix, &jacobi, load, solution, &params, scratch)?;
    Ok(info.iterations)
}
