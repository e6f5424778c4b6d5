//! What paths begin with: numbers of steps from few to all, and the deformations along a flow.

use crate::error::GeodesicError;
use crate::level_sets::{compose, flow_path};
use crate::params::GeodesicParams;
use crate::shape::Shape;
use fe_grid::Grid;
use fe_grid::minimise::Observer;
use levelset::Turn;

/// Returns the largest number of nodes along an axis.
pub(super) fn most_nodes<const D: usize>(grid: &Grid<D>) -> usize {
    grid.nodes_per_axis().into_iter().max().unwrap_or(0)
}

/// Computes the displacements of all deformations along a flow.
pub(super) fn along_flow<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    grid: &Grid<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Vec<f64>, GeodesicError> {
    let path = flow_path(start, end, grid, params, observer)?;
    let parts = path.steps() / params.steps;
    let mut x = Vec::new();
    for k in 1..=params.steps {
        let motion = compose(grid, &path.displacements[..parts * k]);
        x.extend_from_slice(motion.as_slice());
    }
    Ok(x)
}

/// Computes the displacements of all deformations of a path that turns a shape evenly, while its centre moves along a
/// line.
pub(super) fn along_turn<const D: usize>(turn: &Turn<D>, grid: Grid<D>, steps: usize) -> Vec<f64> {
    let parts = (1..=steps).map(|k| turn.part(k as f64 / steps as f64));
    let displacements = parts.map(|part| part.displacement(grid).into_vec());
    displacements.collect::<Vec<_>>().concat()
}

/// Returns increasing numbers of steps: repeated halves, rounded up.
pub(super) fn time_schedule(steps: usize) -> Vec<usize> {
    let mut schedule = vec![steps];
    let mut count = steps;
    while count > 1 {
        count = count.div_ceil(2);
        schedule.push(count);
    }
    schedule.reverse();
    schedule
}

/// Changes the number of steps: displacements are interpolated linearly in time.
pub(super) fn refine_time(x: &[f64], dim: usize, steps: usize, count: usize) -> Vec<f64> {
    let mut refined = vec![0.0; count * dim];
    for (k, out) in refined.chunks_exact_mut(dim).enumerate() {
        let time = (k + 1) as f64 * steps as f64 / count as f64;
        let before = (time.floor() as usize).min(steps);
        let share = time - before as f64;
        for i in 0..dim {
            let at = |j: usize| if j == 0 { 0.0 } else { x[(j - 1) * dim + i] };
            let after = if share > 0.0 { at(before + 1) } else { 0.0 };
            out[i] = (1.0 - share) * at(before) + share * after;
        }
    }
    refined
}
