//! Minimal paths of level sets, from an initial path.

use super::objective::{LevelSetEnergy, LevelSetObjective};
use super::state::PathState;
use crate::descent::{minimiser, repair};
use crate::error::GeodesicError;
use crate::params::GeodesicParams;
use crate::shape::{KnownEnds, Shape};
use fe_grid::Grid;
use fe_grid::compiled_once;
use fe_grid::minimise::{Info, Minimiser, Observer, Status};

/// Factor of the tolerance for a preliminary path.
const COARSE: f64 = 10.0;
/// Convergence history of one level.
#[derive(Clone, Debug)]
pub struct LevelSetLevel {
    /// Nodes along each axis, `x` first.
    pub nodes: Vec<usize>,
    /// Number of steps of the path.
    pub steps: usize,
    /// Record of the minimiser.
    pub info: Info,
    /// Terms of the energy at the end.
    pub energy: LevelSetEnergy,
}

/// A minimal path.
#[derive(Clone, Debug)]
pub struct LevelSetPath<const D: usize> {
    /// The path.
    pub state: PathState<D>,
    /// Convergence history of each level, coarsest first.
    pub levels: Vec<LevelSetLevel>,
}

compiled_once! {
    /// Computes the minimal path of level sets near one of several initial paths, each with `2^m`
    /// times the requested number of steps on the same grid or on one that is coarser by a power of
    /// two. All lie on one grid; the best of them is determined there, and prolonged to the grid of
    /// the shapes.
    ///
    /// A path of many steps is minimised first, in which every deformation is small; then pairs of
    /// steps are joined, and the path is minimised again, until the requested number of steps is
    /// reached. Then the grid is refined.
    ///
    /// # Errors
    /// [`GeodesicError`] for parameters out of range and unsuitable paths.
    pub fn level_set_path<'a, D>(
        first: PathState<D>,
        others: Vec<PathState<D>>,
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<LevelSetPath<D>, GeodesicError> = level_set_path_in;
}

fn level_set_path_in<const D: usize>(
    first: PathState<D>,
    others: Vec<PathState<D>>,
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<LevelSetPath<D>, GeodesicError> {
    params.check()?;
    let finest = *start.grid();
    let joins = |state: &PathState<D>| (state.steps() / params.steps).ilog2() as usize;
    let n_levels = refinements(first.grid(), &finest).max(1)
        + (1 + others.len())
        + joins(&first)
        + others.iter().map(joins).sum::<usize>();
    let mut descent = Descent {
        start,
        end,
        params,
        observer,
        levels: Vec::new(),
        n_levels,
        cancelled: false,
    };
    let (mut state, mut least) = descent.joined(first)?;
    for other in others {
        if descent.cancelled {
            break;
        }
        let (other, energy) = descent.joined(other)?;
        if energy < least && !descent.cancelled {
            (state, least) = (other, energy);
        }
    }
    if *state.grid() == finest && !descent.cancelled {
        (state, _) = descent.minimised(state, 1.0)?;
    }
    while *state.grid() != finest && !descent.cancelled {
        let finer = state.finer();
        let last = *finer.grid() == finest;
        (state, _) = descent.minimised(finer, if last { 1.0 } else { COARSE })?;
    }
    Ok(LevelSetPath {
        state,
        levels: descent.levels,
    })
}

/// Paths between two shapes during the minimisation.
struct Descent<'a, const D: usize> {
    start: &'a Shape<D>,
    end: &'a Shape<D>,
    params: &'a GeodesicParams,
    observer: &'a mut dyn Observer,
    levels: Vec<LevelSetLevel>,
    n_levels: usize,
    cancelled: bool,
}

impl<const D: usize> Descent<'_, D> {
    /// Minimises a path on its own grid down to the requested number of steps; returns it with its
    /// energy.
    fn joined(&mut self, mut state: PathState<D>) -> Result<(PathState<D>, f64), GeodesicError> {
        loop {
            let (minimised, energy) = self.minimised(state, COARSE)?;
            if minimised.steps() <= self.params.steps || self.cancelled {
                return Ok((minimised, energy));
            }
            state = minimised.halved();
        }
    }

    /// Minimises a path on its grid with a multiple of the tolerance; returns it with its energy.
    fn minimised(
        &mut self,
        mut state: PathState<D>,
        factor: f64,
    ) -> Result<(PathState<D>, f64), GeodesicError> {
        let grid = *state.grid();
        // The end shapes are those of this grid, not smoothed by a coarser one.
        let (first, last) = (self.start.on_grid(&grid), self.end.on_grid(&grid));
        let steps = state.steps();
        let known = KnownEnds::new(&first, &last);
        state.shapes[0] = first.components;
        state.shapes[steps] = last.components;
        let layout = state.layout();
        let params = GeodesicParams {
            steps,
            tolerance: factor * self.params.tolerance,
            ..self.params.clone()
        };
        let mut objective = LevelSetObjective::new(grid, steps, &params)?
            .with_components(layout.components)
            .with_known(known);
        let mut x = state.to_vector();
        for k in 1..=steps {
            let solid = objective.solid_cells(&x, k);
            let u = &mut x[layout.displacement(k)];
            repair(&grid, u, params.min_determinant, solid.as_deref());
        }
        self.observer
            .level(self.levels.len(), self.n_levels, x.len());
        let info = minimiser(&params).minimise(&mut objective, &mut x, self.observer)?;
        objective.evaluate(&x, &mut [])?;
        self.cancelled |= info.status == Status::Cancelled;
        let energy = objective.energy().clone();
        let total = energy.total;
        self.levels.push(LevelSetLevel {
            nodes: grid.nodes_per_axis().to_vec(),
            steps,
            info,
            energy,
        });
        Ok((PathState::from_vector(grid, &layout, &x)?, total))
    }
}

/// Returns the number of refinements between two grids.
fn refinements<const D: usize>(coarse: &Grid<D>, fine: &Grid<D>) -> usize {
    (coarse.spacing() / fine.spacing()).round().max(1.0).log2() as usize
}
