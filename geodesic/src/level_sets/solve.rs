//! Minimal paths of level sets, from a first path.

use super::flow::compose;
use super::objective::{LevelSetEnergy, LevelSetObjective};
use super::transport::{displacement, level_set};
use crate::descent::{minimiser, repair};
use crate::{GeodesicError, GeodesicParams};
use fe_grid::minimise::{Info, Minimiser, Observer, Status};
use fe_grid::transfer::prolong_into;
use fe_grid::{Field, Grid};

/// Factor of the tolerance where a path is only preliminary.
const COARSE: f64 = 10.0;
/// A path of level sets and the deformations between them.
#[derive(Clone, Debug)]
pub struct PathState<const D: usize> {
    /// Level sets `u_0, ..., u_K`.
    pub level_sets: Vec<Field<f64, D, 1>>,
    /// Displacements of `phi_1, ..., phi_K`.
    pub displacements: Vec<Field<f64, D, D>>,
}

impl<const D: usize> PathState<D> {
    /// The state as one vector.
    fn to_vector(&self) -> Vec<f64> {
        let mut x = self.level_sets[0].as_slice().to_vec();
        for (u, phi) in self.level_sets[1..].iter().zip(&self.displacements) {
            x.extend_from_slice(phi.as_slice());
            x.extend_from_slice(u.as_slice());
        }
        x
    }

    fn from_vector(grid: Grid<D>, x: &[f64], steps: usize) -> Result<Self, GeodesicError> {
        let n = grid.n_nodes();
        let level_sets: Result<Vec<_>, _> = (0..=steps)
            .map(|k| Field::from_vec(grid, x[level_set(n, D, k)].to_vec()))
            .collect();
        let displacements: Result<Vec<_>, _> = (1..=steps)
            .map(|k| Field::from_vec(grid, x[displacement(n, D, k)].to_vec()))
            .collect();
        Ok(Self {
            level_sets: level_sets?,
            displacements: displacements?,
        })
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.displacements.len()
    }

    /// Every second shape, and the deformations between these.
    fn halved(&self) -> Self {
        let grid = *self.level_sets[0].grid();
        Self {
            level_sets: self.level_sets.iter().step_by(2).cloned().collect(),
            displacements: self
                .displacements
                .chunks(2)
                .map(|pair| compose(&grid, pair))
                .collect(),
        }
    }

    /// The same path on the grid of half the spacing.
    fn finer(&self) -> Self {
        let coarse_grid = *self.level_sets[0].grid();
        let grid = coarse_grid.finer();
        let mut fine = Self {
            level_sets: vec![Field::zeros(grid); self.level_sets.len()],
            displacements: vec![Field::zeros(grid); self.displacements.len()],
        };
        for (fine, coarse) in fine.level_sets.iter_mut().zip(&self.level_sets) {
            prolong_into(&coarse_grid, coarse.as_slice(), fine.as_mut_slice());
        }
        for (fine, coarse) in fine.displacements.iter_mut().zip(&self.displacements) {
            prolong_into(&coarse_grid, coarse.as_slice(), fine.as_mut_slice());
        }
        fine
    }
}

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
