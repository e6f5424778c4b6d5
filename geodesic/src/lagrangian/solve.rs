//! Solution from one step on the coarsest grid to all steps on the finest.

use super::objective::{PathEnergy, PathObjective};
use crate::descent::{minimiser, repair};
use crate::error::GeodesicError;
use crate::level_sets::{compose, flow_path};
use crate::overlap::overlaps;
use crate::params::GeodesicParams;
use crate::shape::{Known, Shape, ShapeOnGrid};
use fe_grid::compiled_once;
use fe_grid::minimise::{Info, Minimiser, Observer, Status};
use fe_grid::transfer::prolong_into;
use fe_grid::{Field, Grid};

/// Convergence history of one level.
#[derive(Clone, Debug)]
pub struct PathLevel {
    /// Nodes along each axis, `x` first.
    pub nodes: Vec<usize>,
    /// Number of steps of the path.
    pub steps: usize,
    /// Record of the minimiser.
    pub info: Info,
    /// Terms of the energy at the end.
    pub energy: PathEnergy,
}

/// A minimal path on the finest level, or on the level where the observer cancelled, with the
/// number of steps of that level.
#[derive(Clone, Debug)]
pub struct LagrangianPath<const D: usize> {
    /// Displacements of `psi_1, ..., psi_K`.
    pub displacements: Vec<Field<f64, D, D>>,
    /// Convergence history of each level, coarsest first.
    pub levels: Vec<PathLevel>,
}

compiled_once! {
    /// Computes the shortest path between two shapes given by their signed distances (positive
    /// inside) on one grid, starting from the identity; if this does not reach the end shape on
    /// coarse grids, a second start is a viscous flow of one shape to the other, and the path of
    /// lower energy is continued.
    ///
    /// # Errors
    /// [`GeodesicError`] for parameters out of range and unsuitable shapes.
    pub fn lagrangian_path<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<LagrangianPath<D>, GeodesicError> = lagrangian_path_in;
}

fn lagrangian_path_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<LagrangianPath<D>, GeodesicError> {
    params.check()?;
    if start.grid() != end.grid() {
        return Err(GeodesicError::GridsDiffer);
    }
    let grids = start.grid().hierarchy(params.coarsest_nodes);
    let mut levels = Vec::new();
    let schedule = time_schedule(params.steps);
    let mut steps = schedule[0];
    let mut x = vec![0.0; steps * D * grids[0].n_nodes()];
    let mut n_runs = grids.len() + schedule.len() - 1;
    let flow_depth = flow_depth(&grids, params);
    let mut reached = grids[0];
    'levels: for (depth, grid) in grids.iter().enumerate() {
        reached = *grid;
        let times = if depth == 0 {
            schedule.as_slice()
        } else {
            &schedule[schedule.len() - 1..]
        };
        let (first, last) = (start.on_grid(grid), end.on_grid(grid));
        for &count in times {
            if count != steps {
                x = refine_time(&x, D * grid.n_nodes(), steps, count);
                steps = count;
            }
            let ends = (first.clone(), last.clone());
            observer.level(levels.len(), n_runs, x.len());
            levels.push(minimised(ends, count, params, &mut x, observer)?);
            if is_cancelled(&levels) {
                break 'levels;
            }
        }
        let unreached = || -> Result<bool, GeodesicError> {
            let last = Field::from_vec(*grid, x[(steps - 1) * D * grid.n_nodes()..].to_vec())?;
            Ok(!overlaps(start, end, &[last], *grid)?.reached())
        };
        if flow_depth == Some(depth) && matches!(start.known(), Known::Everywhere) && unreached()? {
            let mut other = along_flow(start, end, grid, params, observer)?;
            n_runs += 1;
            observer.level(levels.len(), n_runs, other.len());
            let level = minimised((first, last), steps, params, &mut other, observer)?;
            let least = levels.last().map(|level| level.energy.total);
            if least.is_none_or(|least| level.energy.total < least) {
                x = other;
            }
            levels.push(level);
            if is_cancelled(&levels) {
                break 'levels;
            }
        }
        if depth + 1 < grids.len() {
            let fine = D * grids[depth + 1].n_nodes();
            let mut finer = vec![0.0; steps * fine];
            for (out, u) in finer
                .chunks_exact_mut(fine)
                .zip(x.chunks_exact(D * grid.n_nodes()))
            {
                prolong_into(grid, u, out);
            }
            x = finer;
        }
    }
    let displacements: Result<Vec<_>, _> = x
        .chunks_exact(D * reached.n_nodes())
        .map(|u| Field::from_vec(reached, u.to_vec()))
        .collect();
    Ok(LagrangianPath {
        displacements: displacements?,
        levels,
    })
}

/// Minimises the energy of a path of the given number of steps between two shapes on their grid,
/// and reports its convergence.
fn minimised<const D: usize>(
    (first, last): (ShapeOnGrid<D>, ShapeOnGrid<D>),
    steps: usize,
    params: &GeodesicParams,
    x: &mut [f64],
    observer: &mut dyn Observer,
) -> Result<PathLevel, GeodesicError> {
    let mut objective = PathObjective::between(first, last, steps, params)?;
    let grid = *objective.grid();
    for u in x.chunks_exact_mut(D * grid.n_nodes()) {
        repair(&grid, u, params.min_determinant, objective.solid_cells());
    }
    let info = minimiser(params).minimise(&mut objective, x, observer)?;
    objective.evaluate(x, &mut [])?;
    Ok(PathLevel {
        nodes: grid.nodes_per_axis().to_vec(),
        steps,
        info,
        energy: objective.energy().clone(),
    })
}

/// Returns whether the observer has cancelled the last level.
fn is_cancelled(levels: &[PathLevel]) -> bool {
    levels
        .last()
        .is_some_and(|level| level.info.status == Status::Cancelled)
}

/// Returns the level on which a flow is tried as a start: the finest that is coarse enough for it,
/// but not the last.
fn flow_depth<const D: usize>(grids: &[Grid<D>], params: &GeodesicParams) -> Option<usize> {
    let most = |grid: &Grid<D>| grid.nodes_per_axis().iter().copied().max();
    grids[..grids.len() - 1]
        .iter()
        .rposition(|grid| most(grid).is_some_and(|n| n <= params.flow_nodes))
}

/// Computes the displacements of all deformations along a flow.
fn along_flow<const D: usize>(
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

/// Returns increasing numbers of steps: repeated halves, rounded up.
fn time_schedule(steps: usize) -> Vec<usize> {
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
fn refine_time(x: &[f64], dim: usize, steps: usize, count: usize) -> Vec<f64> {
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
