//! Solution from one step on the coarsest grid to all steps on the finest.

use super::objective::PathObjective;
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::level_sets::{compose, flow_path};
use crate::levels::{Descent, Level, LevelReport, PathForm, PathOnLevel};
use crate::overlap::overlaps;
use crate::params::GeodesicParams;
use crate::shape::{Known, Shape};
use fe_grid::compiled_once;
use fe_grid::minimise::Observer;
use fe_grid::transfer::prolong_into;
use fe_grid::{Field, Grid};

/// A minimal path on the finest level, or on the level where the observer cancelled, with the
/// number of steps of that level.
#[derive(Clone, Debug)]
pub struct LagrangianPath<const D: usize> {
    /// Displacements of `psi_1, ..., psi_K`.
    pub displacements: Vec<Field<f64, D, D>>,
    /// Convergence history of each level, coarsest first.
    pub levels: Vec<LevelReport>,
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
    let schedule = time_schedule(params.steps);
    let level = |grid, steps| Level {
        grid,
        steps,
        tolerance: 1.0,
    };
    let mut levels: Vec<_> = schedule.iter().map(|&k| level(grids[0], k)).collect();
    levels.extend(grids[1..].iter().map(|&grid| level(grid, params.steps)));
    let (coarse, fine) = match flow_depth(&grids, params) {
        Some(depth) => levels.split_at(schedule.len() + depth),
        None => (levels.as_slice(), &[][..]),
    };
    let identity = vec![0.0; levels[0].steps * D * grids[0].n_nodes()];
    let form = Deformations { start, end };
    let mut descent = Descent {
        form,
        params,
        n_levels: levels.len(),
        levels: Vec::new(),
        reports: Vec::new(),
    };
    let initial = PathOnLevel::new(levels[0], identity);
    let mut path = descent.minimise(initial, coarse, observer)?;
    let may_flow = !fine.is_empty() && !descent.ended();
    if may_flow && matches!(start.known(), Known::Everywhere) && !reached(start, end, &path)? {
        let flow = along_flow(start, end, &path.level.grid, params, observer)?;
        descent.n_levels += 1;
        let other = PathOnLevel::new(path.level, flow);
        let other = descent.minimise(other, &[path.level], observer)?;
        if other.total < path.total {
            path = other;
        }
    }
    let path = descent.minimise(path, fine, observer)?;
    Ok(LagrangianPath {
        displacements: displacements(&path)?,
        levels: descent.reports,
    })
}

/// Paths as displacements of a start domain, one after the other.
struct Deformations<'a, const D: usize> {
    start: &'a Shape<D>,
    end: &'a Shape<D>,
}

impl<const D: usize> PathForm<D> for Deformations<'_, D> {
    type Objective = PathObjective<D>;

    fn objective(
        &self,
        level: &Level<D>,
        params: &GeodesicParams,
    ) -> Result<PathObjective<D>, GeodesicError> {
        let [first, last] = [self.start, self.end].map(|shape| shape.on_grid(&level.grid));
        PathObjective::between(first, last, level.steps, params)
    }

    fn transfer(
        &self,
        x: &[f64],
        from: &Level<D>,
        to: &Level<D>,
    ) -> Result<Vec<f64>, GeodesicError> {
        let (coarse, fine) = (D * from.grid.n_nodes(), D * to.grid.n_nodes());
        if from.steps != to.steps {
            return Ok(refine_time(x, coarse, from.steps, to.steps));
        }
        let mut finer = vec![0.0; to.steps * fine];
        for (out, u) in finer.chunks_exact_mut(fine).zip(x.chunks_exact(coarse)) {
            prolong_into(&from.grid, u, out);
        }
        Ok(finer)
    }

    fn repair(&self, _level: &Level<D>, objective: &PathObjective<D>, x: &mut [f64]) {
        objective.repair(x);
    }

    fn energy(objective: &PathObjective<D>) -> &PathEnergy {
        objective.energy()
    }
}

/// Returns the displacements of a path.
fn displacements<const D: usize>(
    path: &PathOnLevel<D>,
) -> Result<Vec<Field<f64, D, D>>, GeodesicError> {
    let grid = path.level.grid;
    let parts = path.x.chunks_exact(D * grid.n_nodes());
    Ok(parts
        .map(|u| Field::from_vec(grid, u.to_vec()))
        .collect::<Result<_, _>>()?)
}

/// Returns whether the last deformation of a path maps the start shape to the end shape.
fn reached<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    path: &PathOnLevel<D>,
) -> Result<bool, GeodesicError> {
    let grid = path.level.grid;
    let last = &path.x[(path.level.steps - 1) * D * grid.n_nodes()..];
    let last = Field::from_vec(grid, last.to_vec())?;
    Ok(overlaps(start, end, &[last], grid)?.reached())
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
