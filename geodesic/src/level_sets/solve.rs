//! Minimal paths of level sets, from a first path.

use super::objective::{LevelSetEnergy, LevelSetObjective};
use super::state::PathState;
use super::transport::displacement;
use crate::descent::{minimiser, repair};
use crate::{GeodesicError, GeodesicParams};
use fe_grid::minimise::{Info, Minimiser, Observer, Status};
use fe_grid::{Field, Grid};

/// Factor of the tolerance where a path is only preliminary.
const COARSE: f64 = 10.0;
/// What happened on one level.
#[derive(Clone, Debug)]
pub struct LevelSetLevel {
    /// Nodes along each axis, `x` first.
    pub nodes: Vec<usize>,
    /// Steps of the path.
    pub steps: usize,
    /// The minimiser's record.
    pub info: Info,
    /// The terms at the end.
    pub energy: LevelSetEnergy,
}

/// A minimal path.
#[derive(Clone, Debug)]
pub struct LevelSetPath<const D: usize> {
    /// The path.
    pub state: PathState<D>,
    /// What happened, coarsest first.
    pub levels: Vec<LevelSetLevel>,
}

/// The minimal path of level sets near a first one of `2^m` times as many steps on the same grid
/// or on one that is coarser by a power of two.
///
/// A path of many steps is lowered first, where every deformation is small and nothing jams; then
/// steps are joined in pairs, and the path is lowered again, down to the number of steps that is
/// wanted. Then the grid is refined.
///
/// # Errors
/// [`GeodesicError`] for parameters out of range and paths that do not fit.
pub fn level_set_path<const D: usize>(
    first: PathState<D>,
    start: &Field<f64, D, 1>,
    end: &Field<f64, D, 1>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<LevelSetPath<D>, GeodesicError> {
    params.check()?;
    let finest = *start.grid();
    let mut state = first;
    let mut levels = Vec::new();
    let n_levels = (state.steps() / params.steps).ilog2() as usize
        + refinements(state.level_sets[0].grid(), &finest)
        + 1;
    loop {
        let grid = *state.level_sets[0].grid();
        let steps = state.steps();
        let preliminary = steps > params.steps || grid != finest;
        let level_params = GeodesicParams {
            steps,
            tolerance: if preliminary {
                COARSE * params.tolerance
            } else {
                params.tolerance
            },
            ..params.clone()
        };
        let mut objective = LevelSetObjective::new(grid, steps, &level_params)?;
        let mut x = state.to_vector();
        for k in 1..=steps {
            let solid = objective.solid_cells(&x, k);
            let u = &mut x[displacement(grid.n_nodes(), D, k)];
            repair(&grid, u, params.min_determinant, solid.as_deref());
        }
        observer.level(levels.len(), n_levels, x.len());
        let info = minimiser(&level_params).minimise(&mut objective, &mut x, observer)?;
        objective.evaluate(&x, &mut [])?;
        let cancelled = info.status == Status::Cancelled;
        levels.push(LevelSetLevel {
            nodes: grid.nodes_per_axis().to_vec(),
            steps,
            info,
            energy: objective.energy().clone(),
        });
        state = PathState::from_vector(grid, &x, steps)?;
        if cancelled || !preliminary {
            return Ok(LevelSetPath { state, levels });
        }
        if steps > params.steps {
            state = state.halved();
        } else {
            state = state.finer();
            let fine = *state.level_sets[0].grid();
            // The end shapes are those of this grid, not smoothed by the coarser one.
            let last = state.level_sets.len() - 1;
            state.level_sets[0] = on_grid(&fine, start);
            state.level_sets[last] = on_grid(&fine, end);
        }
    }
}

/// A level set at the nodes of a coarser grid of the same box.
pub(crate) fn on_grid<const D: usize>(
    grid: &Grid<D>,
    level_set: &Field<f64, D, 1>,
) -> Field<f64, D, 1> {
    Field::from_fn(*grid, |x| level_set.sample(x))
}

/// How often a grid has to be refined to become another.
fn refinements<const D: usize>(coarse: &Grid<D>, fine: &Grid<D>) -> usize {
    (coarse.spacing() / fine.spacing()).round().max(1.0).log2() as usize
}
