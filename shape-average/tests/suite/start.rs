//! Averages that go on from deformations that are known.

use crate::support::shapes::{bar, ellipsoid};
use fe_grid::minimise::{Control, Iteration, Observer, Silent, Status};
use fe_grid::{Field, Grid, ScalarField};
use levelset::dice;
use shape_average::joint::{JointParams, joint_average, joint_average_from};
use shape_average::{AverageError, AverageParams, AverageResult, Mean, average, average_from};

/// Stops after so many iterations of a level.
struct Stop {
    level: usize,
    iteration: usize,
    at: usize,
}

impl Observer for Stop {
    fn level(&mut self, level: usize, _n_levels: usize, _dim: usize) {
        self.at = level;
    }

    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        if self.at == self.level && iteration.iteration == self.iteration {
            Control::Cancel
        } else {
            Control::Continue
        }
    }
}

fn stop(level: usize, iteration: usize) -> Stop {
    Stop {
        level,
        iteration,
        at: 0,
    }
}

fn go_on<const D: usize>(
    shapes: &[ScalarField<f64, D>],
    from: &AverageResult<D>,
    params: &AverageParams,
) -> AverageResult<D> {
    let result = average_from(shapes, &[], &from.displacements, params, &mut Silent).unwrap();
    assert!(result.certificate.certified && result.status.converged());
    for level in &result.levels {
        assert!(level.energies.windows(2).all(|w| w[1] <= w[0]), "{level:?}");
    }
    result
}

fn check<const D: usize>(shapes: &[ScalarField<f64, D>], level: usize, params: &AverageParams) {
    let whole = average(shapes, params, &mut Silent).unwrap();
    let stopped = average(shapes, params, &mut stop(level, 2)).unwrap();
    assert_eq!(stopped.status, Status::Cancelled);
    let resumed = go_on(shapes, &stopped, params);
    assert_eq!(resumed.levels.len(), whole.levels.len() - level);
    // It begins where the other was stopped: the average is solved for anew, to its own tolerance.
    let (end, begin) = (
        stopped.levels[level].energies[2],
        resumed.levels[0].energies[0],
    );
    assert!((end / begin - 1.0).abs() < 1e-6, "{end} {begin}");
    // Both end within the tolerance of a level of the same minimum.
    let (a, b) = (whole.energy.total, resumed.energy.total);
    assert!((a / b - 1.0).abs() < 2.0 * params.tolerance, "{a} {b}");
    let overlap = dice(
        &whole.average_indicator,
        0.5,
        &resumed.average_indicator,
        0.5,
    )
    .unwrap();
    // Along a common motion of all shapes the energy hardly changes, and a tenth of a spacing is two
    // hundredths of a ball of five spacings.
    assert!(overlap > 0.98, "{overlap}");
}

#[test]
fn a_run_that_was_stopped_goes_on_where_it_was() {
    let params = AverageParams::default();
    let grid = Grid::<2>::dyadic(6);
    let bars = [bar(grid, 180.0, 0.0), bar(grid, 130.0, 0.2)];
    check(&bars, 1, &params);
    check(&bars, 3, &params);
    let grid = Grid::<3>::dyadic(4);
    let balls = [
        ellipsoid(grid, [0.32, 0.24, 0.24], 0.0),
        ellipsoid(grid, [0.24, 0.3, 0.26], 0.3),
    ];
    check(&balls, 1, &params);
}

/// What is at its minimum has nowhere to go; a finer grid begins one level above.
#[test]
fn a_result_is_the_start_of_a_finer_one() {
    let params = AverageParams::default();
    let shapes = |level| {
        let grid = Grid::<2>::dyadic(level);
        [bar(grid, 180.0, 0.0), bar(grid, 150.0, 0.1)]
    };
    let coarse = average(&shapes(5), &params, &mut Silent).unwrap();
    let again = go_on(&shapes(5), &coarse, &params);
    assert_eq!(again.levels.len(), 1);
    assert!(again.levels[0].iterations <= 5, "{:?}", again.levels[0]);
    let fine = go_on(&shapes(6), &coarse, &params);
    assert_eq!(fine.levels.len(), 2);
    let whole = average(&shapes(6), &params, &mut Silent).unwrap();
    let (a, b) = (whole.energy.total, fine.energy.total);
    assert!((a / b - 1.0).abs() < 2.0 * params.tolerance, "{a} {b}");
}

/// Medians begin with the mean from there, and shapes of weight zero follow as always.
#[test]
fn medians_and_followers_take_a_start() {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [
        bar(grid, 180.0, 0.0),
        bar(grid, 150.0, 0.1),
        bar(grid, 160.0, 0.0),
    ];
    let usual = average(&shapes, &AverageParams::default(), &mut Silent).unwrap();
    let median = AverageParams {
        mean: Mean::Median,
        ..AverageParams::default()
    };
    let found = go_on(&shapes, &usual, &median);
    assert!(
        found.rounds.windows(2).all(|w| w[1] <= w[0]),
        "{:?}",
        found.rounds
    );
    let weighted = AverageParams {
        weights: Some(vec![0.5, 0.5, 0.0]),
        ..AverageParams::default()
    };
    let found = go_on(&shapes, &usual, &weighted);
    assert!(found.mean_dice() > 0.97, "{}", found.mean_dice());
}

#[test]
fn starts_that_do_not_fit_are_refused() {
    let grid = Grid::<2>::dyadic(4);
    let shapes = [bar(grid, 180.0, 0.0), bar(grid, 150.0, 0.1)];
    let zero = Field::<f64, 2, 2>::zeros(grid);
    let finer = Field::zeros(Grid::dyadic(5));
    let mut spoilt = zero.clone();
    spoilt.as_mut_slice()[3] = f64::NAN;
    for start in [
        vec![zero.clone()],
        vec![zero.clone(), finer.clone()],
        vec![finer.clone(), finer],
        vec![zero, spoilt],
    ] {
        let params = AverageParams::default();
        let found = average_from(&shapes, &[], &start, &params, &mut Silent);
        assert!(
            matches!(found, Err(AverageError::Start { .. })),
            "{found:?}"
        );
    }
}

#[test]
fn joint_averages_go_on_too() {
    let grid = Grid::<2>::dyadic(5);
    let images = [-0.05, 0.05].map(|shift| {
        ScalarField::from_fn(grid, |x| {
            let d = 0.25 - (x[0] - 0.5 - shift).hypot(x[1] - 0.5);
            [0.2 + 0.6 * (0.5 + d / grid.spacing()).clamp(0.0, 1.0)]
        })
    });
    let params = JointParams::default();
    let whole = joint_average(&images, &params, &mut Silent).unwrap();
    let stopped = joint_average(&images, &params, &mut stop(1, 1)).unwrap();
    assert_eq!(stopped.status, Status::Cancelled);
    let start = &stopped.displacements;
    let resumed = joint_average_from(&images, start, &params, &mut Silent).unwrap();
    assert!(resumed.certificate.certified);
    assert_eq!(resumed.levels.len(), whole.levels.len() - 1);
    let (a, b) = (whole.energy().total, resumed.energy().total);
    // The rounds of a level end at this share of the energy.
    assert!((a / b - 1.0).abs() < 10.0 * params.tolerance, "{a} {b}");
    let found = joint_average_from(&images, &start[..1], &params, &mut Silent);
    assert!(matches!(found, Err(AverageError::Start { .. })));
}
