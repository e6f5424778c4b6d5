//! Estimate of the memory of an analysis, available before it is computed.

use fe_grid::Grid;
use fe_grid::stencil::half_offsets;
use hyperelastic::CycleMemory;

/// Size of a number in double precision, in bytes.
const DOUBLE: u64 = 8;
/// Vectors of a linear solve: the load as it is given and without rigid part, the solution, its residual,
/// the direction, what is computed from these, and what passes between the levels of a cycle.
const SOLVE: u64 = 9;
/// Vectors of the nonlinear response: six of the minimiser, two of its line search, the load, the response before
/// and after a step, and the gradient.
const RESPONSE: u64 = 12;

/// Estimates the most memory that the [modes](crate::Pca) of an average need at one time, in bytes, with
/// its [balancing](crate::Balancing) if that comes first.
///
/// Counted are all arrays whose size grows with the grid, with the average itself: its deformations and the
/// indicators of its objects. The assembly of the operator, whose arrays are freed before the solves, takes
/// less.
pub fn memory_estimate<const D: usize>(
    n_shapes: usize,
    n_modes: usize,
    balances: bool,
    grid: &Grid<D>,
) -> u64 {
    let d = D as u64;
    let n = n_shapes as u64;
    let modes = n_modes.min(n_shapes.saturating_sub(1)) as u64;
    let of_modes = (n + modes + 1) * d;
    // An average that is moved, and the one before.
    let of_balancing = if balances { 2 * average::<D>(n) } else { 0 };
    in_all(n, SOLVE * d + of_modes.max(of_balancing), grid)
}

/// Estimates the most memory that the [nonlinear response](crate::Finite) of an average needs at one time, in
/// bytes, with its modes: as [`memory_estimate`] counts it.
pub fn memory_estimate_of_response<const D: usize>(
    n_shapes: usize,
    n_modes: usize,
    grid: &Grid<D>,
) -> u64 {
    let d = D as u64;
    let of_modes = (n_modes as u64 + 1) * d;
    // The matrix of a state, and as much while it is assembled.
    let of_matrix = 2 * couplings::<D>();
    in_all(n_shapes as u64, RESPONSE * d + of_modes + of_matrix, grid)
}

/// Fields of an average of `n` shapes, with the object and a displacement of zero.
fn average<const D: usize>(n: u64) -> u64 {
    let d = D as u64;
    n * (d + 1) + 1 + d
}

/// Fields of a matrix of the couplings of neighbouring nodes.
fn couplings<const D: usize>() -> u64 {
    (D * D * half_offsets::<D>().len()) as u64
}

/// The memory of an average of `n` shapes, of its operator, and of so many fields.
fn in_all<const D: usize>(n: u64, fields: u64, grid: &Grid<D>) -> u64 {
    let d = D as u64;
    // Each rigid motion and the functional that excludes it.
    let rigid = 2 * d * d * (d + 1) / 2;
    // With the object, for the modes too, and the derivative of the energy.
    let operator = couplings::<D>() + rigid + 2 + d;
    let cycle = CycleMemory::on(grid);
    let field = DOUBLE * grid.n_nodes() as u64;
    (average::<D>(n) + operator + fields) * field + cycle.matrices + cycle.work_space
}
