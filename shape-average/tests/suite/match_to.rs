//! A shape matched to an average that stays as it is.

use crate::support::run;
use crate::support::shapes::ball;
use fe_grid::Grid;
use fe_grid::minimise::Silent;
use levelset::signed_distance;
use shape_average::{AverageError, AverageParams, match_to};

#[test]
fn a_shape_of_the_average_is_deformed_as_it_was() {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [0.2, 0.3].map(|radius| ball(grid, [0.5; 2], radius));
    let params = AverageParams {
        tolerance: 2e-4,
        ..AverageParams::default()
    };
    let result = run(&shapes, &params);
    let target = signed_distance(&result.average_indicator, 0.5).unwrap();
    for (i, shape) in shapes.iter().enumerate() {
        let found = match_to(shape, &target, &result.average, &params, &mut Silent).unwrap();
        assert!(found.certificate.certified);
        // The average is not touched.
        assert_eq!(found.average, result.average);
        // Both are minimisers of the same two terms, each to its own tolerance.
        let (one, other) = (found.energy.elastic[0], result.energy.elastic[i]);
        assert!((one / other - 1.0).abs() < 0.02, "{one} {other}");
    }
    // A shape that is the average has next to nothing to do: its boundary lies within a spacing of
    // where the phase field has it.
    let same = match_to(&target, &target, &result.average, &params, &mut Silent).unwrap();
    let (left, usual) = (same.energy.elastic[0], result.energy.elastic[0]);
    assert!(left < 0.05 * usual, "{left} {usual}");
}

#[test]
fn fields_of_other_grids_are_refused() {
    let (grid, finer) = (Grid::<2>::dyadic(4), Grid::<2>::dyadic(5));
    let (one, other) = (ball(grid, [0.5; 2], 0.3), ball(finer, [0.5; 2], 0.3));
    let params = AverageParams::default();
    for (target, phase_field) in [(&other, &one), (&one, &other)] {
        let found = match_to(&one, target, phase_field, &params, &mut Silent);
        assert!(matches!(found, Err(AverageError::GridsDiffer { index: 1 })));
    }
}
