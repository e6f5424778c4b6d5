//! Averages on levels that the caller fills.

use crate::support::shapes::bar;
use fe_grid::minimise::Silent;
use fe_grid::transfer::inject_into;
use fe_grid::{Field, Grid, ScalarField};
use shape_average::{AverageError, AverageParams, LevelShapes, average, average_on_levels};

fn bars() -> [ScalarField<f64, 2>; 2] {
    [180.0, 130.0].map(|angle| bar(Grid::dyadic(5), angle, 0.0))
}

/// The program's own phase fields and indicators on all levels, coarsest first.
fn own_levels(bars: &[ScalarField<f64, 2>], params: &AverageParams) -> Vec<LevelShapes<2>> {
    let grids = bars[0].grid().hierarchy(params.coarsest_nodes);
    let mut distances = bars.to_vec();
    let mut levels = Vec::new();
    for grid in grids.iter().rev() {
        if grid != bars[0].grid() {
            for d in &mut distances {
                let mut coarse = Field::zeros(*grid);
                inject_into(grid, d.as_slice(), coarse.as_mut_slice());
                *d = coarse;
            }
        }
        levels.push(LevelShapes::new(*grid, &distances, params).unwrap());
    }
    levels.reverse();
    levels
}

#[test]
fn levels_filled_as_the_program_does_give_the_same_average() {
    let (bars, params) = (bars(), AverageParams::default());
    let own = average(&bars, &params, &mut Silent).unwrap();
    let levels = own_levels(&bars, &params);
    let given = average_on_levels(&bars, levels, &params, &mut Silent).unwrap();
    assert_eq!(own.average, given.average);
    assert_eq!(own.displacements, given.displacements);
}

#[test]
fn other_phase_fields_give_another_average() {
    let (bars, params) = (bars(), AverageParams::default());
    let own = average(&bars, &params, &mut Silent).unwrap();
    let mut levels = own_levels(&bars, &params);
    let finest = levels.len() - 1;
    levels[finest].phase_fields.swap(0, 1);
    let given = average_on_levels(&bars, levels, &params, &mut Silent).unwrap();
    assert_ne!(own.displacements, given.displacements);
}

#[test]
fn levels_that_do_not_fit_are_named() {
    let (bars, params) = (bars(), AverageParams::default());
    let refused = |levels: Vec<LevelShapes<2>>| {
        average_on_levels(&bars, levels, &params, &mut Silent).unwrap_err()
    };
    let own = own_levels(&bars, &params);
    assert_eq!(refused(Vec::new()), AverageError::Levels { level: 0 });
    let mut gap = own.clone();
    gap.remove(1);
    assert_eq!(refused(gap), AverageError::Levels { level: 0 });
    let mut short = own;
    short.pop();
    assert_eq!(refused(short), AverageError::Levels { level: 1 });
}
