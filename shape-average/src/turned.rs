//! Rotations of whole shapes to start from, which cost nothing.
//!
//! A minimiser that begins with the identity does not find the rotation of a shape that lies upside down among others: it
//! bends it the short way. Shapes that overlap much better with the first one after a rotation, see [`Turn`], are turned
//! in a second start. Where this one ends with less energy on coarse grids, it is where the average begins.

use crate::error::AverageError;
use crate::hierarchy::{Levels, solve_levels};
use crate::level::LevelShapes;
use crate::params::{AverageParams, BoundaryCondition};
use crate::quiet::Quiet;
use crate::shapes::Shapes;
use fe_grid::minimise::{Control, Observer};
use fe_grid::{Field, parallel};
use levelset::Turn;

/// Number of nodes along the longest side of the first grid that tells which start is the better one.
const COMPARED_NODES: usize = 17;

/// The displacements on the coarsest level to start from where that is not the identity; those of the shapes of this
/// process. Collective.
pub(crate) fn turned_start<const D: usize>(
    shapes: Shapes<'_, D>,
    levels: &[LevelShapes<D>],
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<Option<Vec<Field<f64, D, D>>>, AverageError> {
    // Fixed faces do not turn, and hidden parts are not compared.
    if params.boundary != BoundaryCondition::Natural || !levels[0].seen().is_empty() {
        return Ok(None);
    }
    let distribution = levels[0].distribution();
    let all = shapes.whole();
    let turns = parallel::map(all[distribution.own()].iter(), &|shape| {
        Turn::between(shape, &all[0])
    });
    let found = turns
        .iter()
        .map(|turn| [f64::from(u8::from(turn.is_some()))]);
    let found: Vec<_> = found.collect();
    if distribution.share(&found).iter().all(|[one]| *one == 0.0) {
        return Ok(None);
    }
    let grid = *levels[0].grid();
    let displacement = |turn: &Option<Turn<D>>| match turn {
        Some(turn) => turn.motion().displacement(grid),
        None => Field::zeros(grid),
    };
    let start: Vec<_> = turns.iter().map(displacement).collect();
    let resolved = |level: &LevelShapes<D>| {
        let nodes = level.grid().nodes_per_axis().into_iter();
        nodes.max() >= Some(COMPARED_NODES)
    };
    let compared = levels.iter().position(resolved).unwrap_or(levels.len() - 1);
    let mut energies = [f64::INFINITY; 2];
    for (energy, turned) in energies.iter_mut().zip([false, true]) {
        let from = start.iter().filter(|_| turned).map(Field::as_slice);
        let problem = Levels::new(levels[..=compared].to_vec(), params).from(from.collect());
        let reached = solve_levels(problem, &mut Quiet(observer))?;
        if reached.cancelled() || observer.between() == Control::Cancel {
            return Ok(None);
        }
        *energy = reached.energy().total;
    }
    Ok((energies[1] < energies[0]).then_some(start))
}
