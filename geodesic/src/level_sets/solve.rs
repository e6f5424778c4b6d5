//! Minimal paths of level sets, from a first path.

use super::objective::{LevelSetEnergy, LevelSetObjective};
use super::transport::{displacement, level_set};
use crate::{GeodesicError, GeodesicParams};
use fe_grid::minimise::{Info, LbfgsParams, Minimiser, Observer, Stopping};
use fe_grid::transfer::{inject_into, prolong_into};
use fe_grid::{Field, Grid, certify_within};

/// Pairs of the L-BFGS memory.
const HISTORY: usize = 10;
/// Iterations after which the metric is made anew.
const METRIC_INTERVAL: usize = 10;
/// Blends to the identity that are tried where a deformation is not admissible.
const REPAIRS: usize = 40;

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

    /// The same path on the grid of twice the spacing.
    fn coarser(&self) -> Option<Self> {
        let grid = self.level_sets[0].grid().coarser()?;
        let mut coarse = Self {
            level_sets: vec![Field::zeros(grid); self.level_sets.len()],
            displacements: vec![Field::zeros(grid); self.displacements.len()],
        };
        for (coarse, fine) in coarse.level_sets.iter_mut().zip(&self.level_sets) {
            inject_into(&grid, fine.as_slice(), coarse.as_mut_slice());
        }
        for (coarse, fine) in coarse.displacements.iter_mut().zip(&self.displacements) {
            inject_into(&grid, fine.as_slice(), coarse.as_mut_slice());
        }
        Some(coarse)
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

/// The minimal path of level sets near a first one, from the grid that is `coarsenings` times
/// coarser up to that of the first path.
///
/// # Errors
/// [`GeodesicError`] for parameters out of range and paths that do not fit.
pub fn level_set_path<const D: usize>(
    first: &PathState<D>,
    params: &GeodesicParams,
    coarsenings: usize,
    observer: &mut dyn Observer,
) -> Result<LevelSetPath<D>, GeodesicError> {
    params.check()?;
    let mut pyramid = vec![first.clone()];
    for _ in 0..coarsenings {
        let Some(coarser) = pyramid.last().and_then(PathState::coarser) else {
            break;
        };
        pyramid.push(coarser);
    }
    let mut levels = Vec::new();
    let mut state: Option<PathState<D>> = None;
    let n_levels = pyramid.len();
    while let Some(given) = pyramid.pop() {
        let current = match state {
            None => given,
            Some(coarse) => {
                let mut fine = coarse.finer();
                // The end shapes are those of this grid.
                fine.level_sets[0] = given.level_sets[0].clone();
                let last = fine.level_sets.len() - 1;
                fine.level_sets[last] = given.level_sets[last].clone();
                fine
            }
        };
        let grid = *current.level_sets[0].grid();
        let steps = current.steps();
        let mut x = current.to_vector();
        let mut objective = LevelSetObjective::new(grid, steps, params)?;
        repair(&objective, &grid, &mut x, steps, params.min_determinant);
        observer.level(levels.len(), n_levels, x.len());
        let info = minimiser(params).minimise(&mut objective, &mut x, observer)?;
        objective.evaluate(&x, &mut [])?;
        levels.push(LevelSetLevel {
            nodes: grid.nodes_per_axis().to_vec(),
            steps,
            info,
            energy: objective.energy().clone(),
        });
        state = Some(PathState::from_vector(grid, &x, steps)?);
    }
    Ok(LevelSetPath {
        state: state.unwrap_or_else(|| first.clone()),
        levels,
    })
}

fn minimiser(params: &GeodesicParams) -> LbfgsParams {
    LbfgsParams {
        metric_interval: METRIC_INTERVAL,
        history: HISTORY,
        stopping: Stopping {
            relative_gradient: 0.0,
            relative_decrement: 0.1 * params.tolerance,
            relative_energy: params.tolerance,
            energy_window: 5,
            energy_floor: 0.0,
            least_excess: 0.0,
            max_iterations: params.max_iterations,
        },
        ..LbfgsParams::default()
    }
}

/// Draws deformations that are not admissible to the identity until they are.
fn repair<const D: usize>(
    objective: &LevelSetObjective<D>,
    grid: &Grid<D>,
    x: &mut [f64],
    steps: usize,
    bound: f64,
) {
    for k in 1..=steps {
        let solid = objective.solid_cells(x, k);
        let u = &mut x[displacement(grid.n_nodes(), D, k)];
        let mut done = false;
        for _ in 0..REPAIRS {
            done = certify_within(grid, u, bound, bound, solid.as_deref()).certified;
            if done {
                break;
            }
            for u in &mut *u {
                *u *= 0.9;
            }
        }
        if !done {
            u.fill(0.0);
        }
    }
}
