//! Estimate of the memory of an analysis, available before it is computed.

use fe_grid::Grid;
use fe_grid::stencil::half_offsets;
use hyperelastic::CycleMemory;

/// Size of a number in double precision, in bytes.
const DOUBLE: u64 = 8;
/// Vectors of a linear solve: the load as it is given and without rigid part, the solution, its residual,
/// the direction, what is computed from these, and what passes between the levels of a cycle.
const SOLVE: u64 = 9;

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
    let (d, n) = (D as u64, n_shapes as u64);
    let modes = n_modes.min(n_shapes.saturating_sub(1)) as u64;
    let field = DOUBLE * grid.n_nodes() as u64;
    // With the object and a displacement of zero.
    let average = n * (d + 1) + 1 + d;
    let couplings = d * d * half_offsets::<D>().len() as u64;
    // Each rigid motion and the functional that excludes it.
    let rigid = 2 * d * d * (d + 1) / 2;
    // With the object, for the modes too, and the derivative of the energy.
    let operator = couplings + rigid + 2 + d;
    let cycle = CycleMemory::on(grid);
    let solve = SOLVE * d;
    let of_modes = (n + modes + 1) * d;
    // An average that is moved, and the one before.
    let of_balancing = if balances { 2 * average } else { 0 };
    (average + operator + solve + of_modes.max(of_balancing)) * field
        + cycle.matrices
        + cycle.work_space
}
