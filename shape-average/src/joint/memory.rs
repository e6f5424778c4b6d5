//! Estimate of the memory of an average of images, available before it is computed.

use super::params::JointParams;
use crate::memory::memory_estimate as of_shapes;
use crate::params::{AverageParams, Precision};
use fe_grid::{Distribution, Grid};

/// Estimates the most memory that an average of images needs at one time on this process, in bytes: all arrays
/// of the deformations on the finest level whose size grows with the grid, and the images with their phase
/// fields. The segmentation, in turn with the deformations, takes less.
pub fn memory_estimate<const D: usize>(
    params: &JointParams,
    distribution: &Distribution,
    grid: &Grid<D>,
) -> u64 {
    // The pairs of the minimiser stay in single precision, whatever that of the metric.
    let params = AverageParams {
        precision: Some(Precision::Double),
        ..params.average.clone()
    };
    let average = of_shapes(&params, distribution, 1, false, grid);
    // The smooth image and its phase field, that again and an indicator for the deformations.
    let mut fields = 4 * grid.n_nodes();
    // The images themselves, on all levels.
    let mut level = Some(*grid);
    while let Some(grid) = level {
        fields += grid.n_nodes();
        level = grid.coarser();
    }
    let own = distribution.own().len();
    // Images of other processes are read only.
    let others = (distribution.n_parts() - own) * grid.n_nodes();
    let images = (own * fields + others) * size_of::<f64>();
    average.memory - average.shapes + images as u64
}
