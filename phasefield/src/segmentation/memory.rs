//! Estimate of the memory of a segmentation, available before it is computed.

use fe_grid::Grid;

/// Fields on the finest grid: the image, twice; the state, and two more when two starts are compared; the
/// gradient, a direction and its image, each of both parts; the right-hand side, the step, and four vectors
/// of conjugate gradients.
const FINEST: usize = 2 + 2 * 3 + 2 * 3 + 2 + 4;
/// Fields on all grids: the image, two numbers per cell, the diagonal, and five vectors of a cycle.
const ALL: usize = 1 + 2 + 1 + 5;

/// Estimates the most memory that the segmentation of an image needs at one time, in bytes: all arrays whose
/// size grows with the grid.
pub fn memory_estimate<const D: usize>(grid: &Grid<D>) -> u64 {
    let mut fields = FINEST * grid.n_nodes();
    let mut level = Some(*grid);
    while let Some(grid) = level {
        fields += ALL * grid.n_nodes();
        level = grid.coarser();
    }
    (size_of::<f64>() * fields) as u64
}
