//! Averages of shapes of which parts are hidden.

use crate::support::shapes::{bar, ellipsoid};
use fe_grid::minimise::{Evaluation, Objective, Silent};
use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, Moments};
use shape_average::{
    AverageError, AverageObjective, AverageParams, AverageResult, LevelShapes, average,
    average_of_visible,
};

fn everywhere<const D: usize>(grid: Grid<D>) -> ScalarField<f64, D> {
    ScalarField::from_fn(grid, |_| [1.0])
}

/// Zero beyond a plane, with a ramp of two spacings.
fn before<const D: usize>(grid: Grid<D>, end: f64) -> ScalarField<f64, D> {
    let ramp = 2.0 * grid.spacing();
    ScalarField::from_fn(grid, |x| [((end - x[0]) / ramp).clamp(0.0, 1.0)])
}

/// The shape as it would be drawn if nothing lay beyond the plane.
fn cut<const D: usize>(shape: &ScalarField<f64, D>, end: f64) -> ScalarField<f64, D> {
    let cut = ScalarField::from_fn(*shape.grid(), |x| [shape.sample(x)[0].min(end - x[0])]);
    levelset::signed_distance(&cut, 0.0).unwrap()
}

fn run<const D: usize>(
    shapes: &[ScalarField<f64, D>],
    seen: &[ScalarField<f64, D>],
) -> AverageResult<D> {
    let result = average_of_visible(shapes, seen, &AverageParams::default(), &mut Silent).unwrap();
    assert!(result.certificate.certified);
    for level in &result.levels {
        assert!(level.energies.windows(2).all(|w| w[1] <= w[0]), "{level:?}");
    }
    result
}

/// Weights of one change rounding only: shape functions add up to one within that.
#[test]
fn what_is_seen_everywhere_is_the_plain_average() {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [bar(grid, 180.0, 0.0), bar(grid, 130.0, 0.2)];
    let plain = average(&shapes, &AverageParams::default(), &mut Silent).unwrap();
    let seen = run(&shapes, &[everywhere(grid), everywhere(grid)]);
    let ends = |result: &AverageResult<2>| -> Vec<Vec<f64>> {
        let levels = result.levels.iter();
        levels.map(|level| level.energies.clone()).collect()
    };
    for (a, b) in ends(&plain)[0].iter().zip(&ends(&seen)[0]) {
        // The minimiser carries rounding on, far below its own tolerance.
        assert!((a - b).abs() <= 1e-9 * a, "{a} {b}");
    }
    // Nothing holds the average in its place: rounding, carried on, moves it by hundredths of a cell.
    // What does not depend on the place is the same within the tolerance of the minimiser.
    let [(elastic, volume), (elastic_seen, volume_seen)] = [&plain, &seen].map(|result| {
        let outline = levelset::contour(&result.average_indicator, 0.5, BoxEdge::Closed).unwrap();
        let volume = Moments::of_contour(&outline).unwrap().volume;
        (result.energy.parts[0], volume)
    });
    assert!((elastic - elastic_seen).abs() <= 0.01 * elastic);
    assert!((volume - volume_seen).abs() <= 0.005 * volume);
}

/// A third of one shape is hidden, and the hidden end drawn as if it were the shape's: the average is
/// that of the whole shapes where a mask tells what was seen, and is not without.
fn hidden_part_is_not_missed<const D: usize>(shapes: &[ScalarField<f64, D>], end: f64, share: f64) {
    let grid = *shapes[0].grid();
    let mut partly = shapes.to_vec();
    partly[0] = cut(&shapes[0], end);
    let mut seen = vec![everywhere(grid); shapes.len()];
    // The edge itself, which is none of the shape's, is hidden as well.
    seen[0] = before(grid, end - 2.0 * grid.spacing());
    let whole = run(shapes, &[]);
    let known = run(&partly, &seen);
    let blind = run(&partly, &[]);
    // Volumes, since nothing holds an average in its place.
    let [whole, known_volume, blind] = [&whole, &known, &blind].map(|result| {
        Moments::of_density(&result.average_indicator)
            .unwrap()
            .volume
    });
    let (missed, cut_off) = ((known_volume - whole).abs(), whole - blind);
    // Not all of the missing part is found: the hidden end still is matter of that shape, cut off.
    assert!(missed < share * cut_off, "{missed} {cut_off}");
    assert!(known.dice[0] > 0.97, "{:?}", known.dice);
}

#[test]
fn hidden_parts_are_not_missed() {
    let grid = Grid::<2>::dyadic(6);
    hidden_part_is_not_missed(
        &[
            bar(grid, 180.0, 0.0),
            bar(grid, 160.0, 0.0),
            bar(grid, 160.0, 0.1),
        ],
        0.62,
        0.2,
    );
}

// A twentieth of the volume is a quarter of a cell all round on this grid.
#[test]
fn hidden_parts_are_not_missed_in_space() {
    let grid = Grid::<3>::dyadic(4);
    hidden_part_is_not_missed(
        &[
            ellipsoid(grid, [0.3, 0.2, 0.2], 0.0),
            ellipsoid(grid, [0.3, 0.22, 0.2], 0.0),
            ellipsoid(grid, [0.28, 0.22, 0.22], 0.0),
        ],
        0.62,
        0.5,
    );
}

/// The gradient of the reduced functional against differences along a fixed direction.
#[test]
fn the_gradient_is_the_derivative() {
    let grid = Grid::<2>::dyadic(4);
    let shapes = [bar(grid, 180.0, 0.0), bar(grid, 130.0, 0.2)];
    let seen = vec![before(grid, 0.55), everywhere(grid)];
    let params = AverageParams::default();
    let level = LevelShapes::new(grid, &shapes, &params).unwrap();
    let start = vec![1.0; grid.n_nodes()];
    let mut objective = AverageObjective::new(level.with_visibility(seen), &params, start).unwrap();
    let wave = |k: usize, speed: f64| 0.01 * (speed * k as f64).sin();
    let x: Vec<f64> = (0..objective.dim()).map(|k| wave(k, 0.37)).collect();
    let direction: Vec<f64> = (0..objective.dim()).map(|k| wave(k, 0.73)).collect();
    let mut gradient = vec![0.0; objective.dim()];
    objective.value_and_gradient(&x, &mut gradient).unwrap();
    let slope: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
    let mut at = |t: f64| {
        let moved: Vec<f64> = x.iter().zip(&direction).map(|(x, d)| x + t * d).collect();
        match objective.value(&moved).unwrap() {
            Evaluation::Value(energy) => energy,
            Evaluation::Inadmissible => panic!("a small displacement"),
        }
    };
    // Rounding of 1e-13 over the step, and hardly a point that crosses into another cell.
    let t = 1e-5;
    let difference = (at(t) - at(-t)) / (2.0 * t);
    assert!(
        (difference - slope).abs() < 1e-4 * slope.abs(),
        "{difference} {slope}"
    );
}

#[test]
fn weights_that_do_not_fit_are_refused() {
    let grid = Grid::<2>::dyadic(4);
    let shapes = [bar(grid, 180.0, 0.0), bar(grid, 160.0, 0.0)];
    let refused = |seen: &[ScalarField<f64, 2>]| {
        let found = average_of_visible(&shapes, seen, &AverageParams::default(), &mut Silent);
        matches!(found, Err(AverageError::Masked { .. }))
    };
    let one = everywhere(grid);
    assert!(refused(std::slice::from_ref(&one)));
    assert!(refused(&[one.clone(), everywhere(Grid::dyadic(3))]));
    assert!(refused(&[one.clone(), ScalarField::zeros(grid)]));
    assert!(refused(&[one, ScalarField::from_fn(grid, |_| [f64::NAN])]));
}
