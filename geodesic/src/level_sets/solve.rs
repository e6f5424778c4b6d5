//! Minimal paths of level sets, from an initial path.

use super::objective::LevelSetObjective;
use super::state::{Layout, PathState};
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::levels::{Descent, Level, LevelReport, PathForm, PathOnLevel};
use crate::params::GeodesicParams;
use crate::shape::{KnownEnds, Shape, ShapeOnGrid, check_known};
use fe_grid::minimise::Observer;
use fe_grid::{Grid, compiled_once};

/// Factor of the tolerance for a preliminary path.
const COARSE: f64 = 10.0;

/// A minimal path of level sets on the finest level, or on the level where the observer cancelled.
#[derive(Clone, Debug)]
pub struct LevelSetPath<const D: usize> {
    /// The path.
    pub state: PathState<D>,
    /// Convergence history of each level, in order.
    pub levels: Vec<LevelReport>,
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
    ///
    /// # Panics
    /// If there is no initial path.
    pub fn level_set_path<'a, D>(
        paths: &'a [PathState<D>],
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<LevelSetPath<D>, GeodesicError> = level_set_path_in;
}

fn level_set_path_in<const D: usize>(
    paths: &[PathState<D>],
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<LevelSetPath<D>, GeodesicError> {
    params.check()?;
    check_known(start, end, params.steps)?;
    let first = &paths[0];
    let refined = refinements(*first.grid(), *start.grid(), params.steps);
    let joined: Vec<_> = paths
        .iter()
        .map(|path| halvings(path, params.steps))
        .collect();
    let n_levels = refined.len() + joined.iter().map(Vec::len).sum::<usize>();
    let form = LevelSets {
        start,
        end,
        components: first.layout().components,
    };
    let mut descent = Descent {
        form,
        params,
        n_levels,
        levels: Vec::new(),
        reports: Vec::new(),
    };
    let initial =
        |state: &PathState<D>, levels: &[Level<D>]| PathOnLevel::new(levels[0], state.to_vector());
    let mut path = descent.minimise(initial(first, &joined[0]), &joined[0], observer)?;
    for (other, levels) in paths.iter().zip(&joined).skip(1) {
        let other = descent.minimise(initial(other, levels), levels, observer)?;
        if other.total < path.total && !descent.ended() {
            path = other;
        }
    }
    let path = descent.minimise(path, &refined, observer)?;
    Ok(LevelSetPath {
        state: descent.form.state(&path.level, &path.x)?,
        levels: descent.reports,
    })
}

/// Returns the levels on which a path is minimised on its own grid, down to a number of steps.
fn halvings<const D: usize>(state: &PathState<D>, steps: usize) -> Vec<Level<D>> {
    let joins = (state.steps() / steps).ilog2();
    let level = |join| Level {
        grid: *state.grid(),
        steps: state.steps() >> join,
        tolerance: COARSE,
    };
    (0..=joins).map(level).collect()
}

/// Returns the levels of a path from the grid of the initial paths to the finest grid.
fn refinements<const D: usize>(first: Grid<D>, finest: Grid<D>, steps: usize) -> Vec<Level<D>> {
    let level = |grid| Level {
        grid,
        steps,
        tolerance: if grid == finest { 1.0 } else { COARSE },
    };
    if first == finest {
        return vec![level(first)];
    }
    let finer = std::iter::successors(Some(first.finer()), |grid| {
        (*grid != finest).then(|| grid.finer())
    });
    finer.map(level).collect()
}

/// Paths as level sets of shapes and displacements between them.
struct LevelSets<'a, const D: usize> {
    start: &'a Shape<D>,
    end: &'a Shape<D>,
    components: usize,
}

impl<const D: usize> LevelSets<'_, D> {
    fn layout(&self, level: &Level<D>) -> Layout<D> {
        Layout {
            nodes: level.grid.n_nodes(),
            components: self.components,
            steps: level.steps,
        }
    }

    fn state(&self, level: &Level<D>, x: &[f64]) -> Result<PathState<D>, GeodesicError> {
        PathState::from_vector(level.grid, &self.layout(level), x)
    }

    fn ends(&self, level: &Level<D>) -> [ShapeOnGrid<D>; 2] {
        [self.start, self.end].map(|shape| shape.on_grid(&level.grid))
    }
}

impl<const D: usize> PathForm<D> for LevelSets<'_, D> {
    type Objective = LevelSetObjective<D>;

    fn objective(
        &self,
        level: &Level<D>,
        params: &GeodesicParams,
    ) -> Result<LevelSetObjective<D>, GeodesicError> {
        let [first, last] = self.ends(level);
        let objective = LevelSetObjective::new(level.grid, level.steps, params)?;
        Ok(objective
            .with_components(self.components)
            .with_known(KnownEnds::new(&first, &last)))
    }

    fn transfer(
        &self,
        x: &[f64],
        from: &Level<D>,
        to: &Level<D>,
    ) -> Result<Vec<f64>, GeodesicError> {
        let state = self.state(from, x)?;
        let state = if from.steps == to.steps {
            state.finer()
        } else {
            state.halved()
        };
        Ok(state.to_vector())
    }

    fn repair(&self, level: &Level<D>, objective: &LevelSetObjective<D>, x: &mut [f64]) {
        // The end shapes are those of this grid, not smoothed by a coarser one.
        let layout = self.layout(level);
        for (k, shape) in [0, level.steps].into_iter().zip(self.ends(level)) {
            for (component, u) in shape.components.iter().enumerate() {
                x[layout.level_set(k, component)].copy_from_slice(u.as_slice());
            }
        }
        objective.repair(x);
    }

    fn energy(objective: &LevelSetObjective<D>) -> &PathEnergy {
        objective.energy()
    }
}
