//! What paths begin with: numbers of steps from few to all, and the deformations along a flow.

use super::eulerian::step_between;
use crate::error::GeodesicError;
use crate::level_sets::{compose, first_paths, flow_path, level_set_path};
use crate::levels::LevelReport;
use crate::params::{Form, GeodesicParams};
use crate::shape::Shape;
use fe_grid::Grid;
use fe_grid::minimise::Observer;
use levelset::{Turn, signed_distance};

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

/// A shape between two others, and displacements of its deformations.
type Between<const D: usize> = (Shape<D>, Vec<f64>);

/// A shape between both, and displacements of its deformations into all shapes of a path, one after the other: those of
/// the path of level sets on a coarse grid, with the reports of its levels. `None` if the shape vanishes.
pub(super) fn along_level_sets<const D: usize>(
    [start, end]: [&Shape<D>; 2],
    grid: &Grid<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<(Option<Between<D>>, Vec<LevelReport>), GeodesicError> {
    let coarse = |shape: &Shape<D>| Shape::of_components(shape.on_grid(grid).components);
    let (first, last) = (coarse(start)?, coarse(end)?);
    let own = GeodesicParams {
        form: Form::LevelSets,
        ..params.clone()
    };
    let paths = first_paths(&first, &last, &own, observer)?;
    let path = level_set_path(&paths, &first, &last, &own, observer)?;
    let (path, levels) = (path.state, path.levels);
    let middle = path.steps() / 2;
    let finest = *start.grid();
    let fine = path.shapes[middle].iter();
    let fine = fine.map(|u| signed_distance(&u.on_grid(&finest), 0.0).ok());
    let Some(components) = fine.collect() else {
        return Ok((None, levels));
    };
    let shape = Shape::of_components(components)?;
    if shape.check("middle").is_err() {
        return Ok((None, levels));
    }
    let motion = |k: usize| compose(grid, &path.displacements[..k]);
    let before = motion(middle);
    let motions = (0..=path.steps()).map(|k| step_between(&before, &motion(k)).into_vec());
    let between = (shape, motions.collect::<Vec<_>>().concat());
    Ok((Some(between), levels))
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

/// Changes the number of steps: displacements are interpolated linearly in time. The first deformation is the identity
/// where it is held, and else one of the unknown ones.
pub(super) fn refine_time(
    x: &[f64],
    dim: usize,
    [steps, count]: [usize; 2],
    held: bool,
) -> Vec<f64> {
    let first = usize::from(held);
    let mut refined = vec![0.0; (count + 1 - first) * dim];
    for (k, out) in refined.chunks_exact_mut(dim).enumerate() {
        let time = (k + first) as f64 * steps as f64 / count as f64;
        let before = (time.floor() as usize).min(steps);
        let share = time - before as f64;
        for i in 0..dim {
            let at = |j: usize| {
                if j < first {
                    0.0
                } else {
                    x[(j - first) * dim + i]
                }
            };
            let after = if share > 0.0 { at(before + 1) } else { 0.0 };
            out[i] = (1.0 - share) * at(before) + share * after;
        }
    }
    refined
}
