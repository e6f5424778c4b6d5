//! Estimate of the memory of the calculus, available before anything is computed.

use super::params::CalculusParams;
use fe_grid::Grid;
use hyperelastic::CycleMemory;

/// Size of a number in double precision, in bytes.
const DOUBLE: u64 = 8;
/// Displacements of an equation: the state, the best one and the next with their corrections, the step between
/// them, and the difference that the history takes up.
const STATES: u64 = 8;
/// The guess, the pair of displacements whose energy is computed, the forces on both, now and before, and the
/// residual.
const EQUATION: u64 = 8;
/// Displacements between equations: the identity and the two points that the next one follows; of a ladder the
/// variation, its side and the middle.
const POINTS: u64 = 6;
/// Signed distances: of the start shape as it is given and as it is kept, its matter, and its cells.
const SCALARS: u64 = 4;

/// Estimates the most memory that an [extension](super::exponential()) needs at one time, or the
/// [transport](super::transport()) along a path, in bytes: with the deformations of the path that are given,
/// and those that are found.
///
/// Counted are all arrays whose size grows with the grid.
pub fn memory_estimate<const D: usize>(
    params: &CalculusParams,
    n_given: usize,
    n_found: usize,
    grid: &Grid<D>,
) -> u64 {
    let (d, points) = (D as u64, (n_given + n_found) as u64 + POINTS);
    let history = 2 * params.history as u64;
    let rigid = d * (d + 1) / 2;
    let displacements = points + STATES + EQUATION + history + rigid;
    let cycle = CycleMemory::on(grid);
    let fields = displacements * d + SCALARS;
    fields * DOUBLE * grid.n_nodes() as u64 + cycle.matrices + cycle.work_space
}
