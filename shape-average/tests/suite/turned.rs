//! Averages of shapes that are not aligned: rotations cost nothing.

use crate::support::shapes::{ball, ellipsoid, shape, turned};
use fe_grid::minimise::{Control, Iteration, Observer, Silent, Status};
use fe_grid::{Grid, ScalarField};
use levelset::{Cause, signed_distance};
use shape_average::{AverageParams, BoundaryCondition, Mean, average, average_from, match_to};

/// A bracket of two rounded bars about the middle of the box, which no rotation maps to itself, turned in the plane by an
/// angle in degrees.
fn bracket<const D: usize>(grid: Grid<D>, degrees: f64) -> ScalarField<f64, D> {
    shape(grid, |x| {
        let y = turned(x, -degrees.to_radians());
        let bar = |from: [f64; 3], to: [f64; 3]| {
            let apart = (0..D).map(|k| (y[k] - y[k].clamp(from[k], to[k])).powi(2));
            0.09 - apart.sum::<f64>().sqrt()
        };
        let foot = bar([0.35, 0.38, 0.45], [0.7, 0.38, 0.45]);
        foot.max(bar([0.35, 0.38, 0.45], [0.35, 0.6, 0.6]))
    })
}

/// The shapes that lie turned, with the angles by which the others are turned onto the first.
fn turned_ones<const D: usize>(
    shapes: &[ScalarField<f64, D>],
    params: &AverageParams,
) -> Vec<(usize, f64)> {
    let found = average(shapes, params, &mut Silent).unwrap();
    let doubts = found.doubts(params).into_iter();
    let doubts = doubts.filter(|doubt| doubt.cause == Cause::Turned);
    let doubted: Vec<_> = doubts.map(|doubt| doubt.shape.unwrap()).collect();
    let list = found.turned.iter();
    let list: Vec<_> = list.map(|turned| (turned.shape, turned.degrees)).collect();
    assert_eq!(doubted, list.iter().map(|one| one.0).collect::<Vec<_>>());
    list
}

fn assert_found(found: &[(usize, f64)], expected: &[(usize, f64)]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!(found.0, expected.0);
        // On 17 nodes a degree moves the tip of a bar by a tenth of a cell.
        assert!((found.1 - expected.1).abs() < 4.0, "{found:?} {expected:?}");
    }
}

#[test]
fn shapes_that_lie_turned_are_named() {
    fn check<const D: usize>(params: &AverageParams) {
        let shapes =
            [0.0, 180.0, 10.0, 110.0].map(|degrees| bracket(Grid::<D>::dyadic(4), degrees));
        assert_found(&turned_ones(&shapes, params), &[(1, 180.0), (3, 110.0)]);
    }
    check::<2>(&AverageParams::default());
    check::<3>(&AverageParams::default());
    check::<2>(&AverageParams {
        mean: Mean::Median,
        ..AverageParams::default()
    });
    // One that the minimiser turns is not named beside one that it does not, and an outlier of a median is.
    let grid = Grid::<2>::dyadic(5);
    let shapes = [0.0, 40.0, 180.0].map(|degrees| bracket(grid, degrees));
    assert_found(
        &turned_ones(&shapes, &AverageParams::default()),
        &[(2, 180.0)],
    );
    let shapes = [0.0, 5.0, -5.0, 3.0, 180.0].map(|degrees| bracket(grid, degrees));
    let median = AverageParams {
        mean: Mean::Median,
        ..AverageParams::default()
    };
    assert_found(&turned_ones(&shapes, &median), &[(4, 180.0)]);
    // Also where the minimisation begins with deformations that are known.
    let shapes = [&shapes[0], &shapes[4]].map(Clone::clone);
    let params = AverageParams::default();
    let first = average(&shapes, &params, &mut Silent).unwrap();
    let known = &first.displacements;
    let again = average_from(&shapes, &[], known, &params, &mut Silent).unwrap();
    assert_eq!(again.turned.len(), 1);
    // A disk has no angle: of the drops after it, two are turned onto the third.
    let mut shapes = vec![ball(grid, [0.5; 2], 0.2)];
    shapes.extend([0.0, 120.0, 240.0].map(|degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        shape(grid, |[x, y]| {
            let part = |k: usize| {
                let t = k as f64 / 20.0;
                let from = [0.5 + (0.35 * t - 0.1) * cos, 0.5 + (0.35 * t - 0.1) * sin];
                0.19 - 0.14 * t - (x - from[0]).hypot(y - from[1])
            };
            (0..=20).map(part).fold(f64::NEG_INFINITY, f64::max)
        })
    }));
    let named = turned_ones(&shapes, &AverageParams::default());
    assert!(named.len() >= 2 && named[0].0 > 0, "{named:?}");
    // The leaders of an average have other places.
    let shapes = [10.0, 0.0, 160.0].map(|degrees| bracket(Grid::<2>::dyadic(5), degrees));
    let params = AverageParams {
        weights: Some(vec![0.0, 0.5, 0.5]),
        ..AverageParams::default()
    };
    assert_found(&turned_ones(&shapes, &params), &[(2, 160.0)]);
}

/// Nothing is named where shapes fit each other as they are, where the faces of the box are fixed, and where shapes are
/// nearly round.
#[test]
fn other_shapes_are_not_named() {
    let grid = Grid::<2>::dyadic(5);
    let turns = [0.0, 20.0, -10.0].map(f64::to_radians);
    let ellipses = turns.map(|turn| ellipsoid(grid, [0.3, 0.15], turn));
    let round = [[0.22, 0.2], [0.2, 0.22], [0.23, 0.21]].map(|radii| ellipsoid(grid, radii, 0.0));
    let fixed = AverageParams {
        boundary: BoundaryCondition::Identity,
        ..AverageParams::default()
    };
    let natural = AverageParams::default();
    let turned = [0.0, 180.0].map(|degrees| bracket(grid, degrees));
    for (shapes, params) in [
        (&ellipses[..], &natural),
        (&round, &natural),
        (&turned, &fixed),
    ] {
        assert_found(&turned_ones(shapes, params), &[]);
    }
}

/// A shape that is deformed onto an average afterwards is named, too.
#[test]
fn shapes_beside_an_average_are_named() {
    let grid = Grid::<2>::dyadic(5);
    let params = AverageParams::default();
    let shapes = [0.0, 2.0].map(|degrees| bracket(grid, degrees));
    let result = average(&shapes, &params, &mut Silent).unwrap();
    let target = signed_distance(&result.average_indicator, 0.5).unwrap();
    let fit = |degrees| {
        let shape = bracket(grid, degrees);
        match_to(&shape, &target, &result.average, &params, &mut Silent).unwrap()
    };
    let [straight, turned] = [0.0, 160.0].map(fit);
    assert!(straight.turned.is_empty());
    let turned = turned.turned.iter();
    let turned: Vec<_> = turned
        .map(|turned| (turned.shape, turned.degrees))
        .collect();
    assert_found(&turned, &[(0, 160.0)]);
}

/// Cancels everything, also what is not reported.
struct Cancel;

impl Observer for Cancel {
    fn iteration(&mut self, _iteration: &Iteration<'_>) -> Control {
        Control::Cancel
    }

    fn between(&mut self) -> Control {
        Control::Cancel
    }
}

#[test]
fn the_comparison_of_starts_is_cancelled() {
    let shapes = [0.0, 180.0].map(|degrees| bracket(Grid::<2>::dyadic(5), degrees));
    let found = average(&shapes, &AverageParams::default(), &mut Cancel).unwrap();
    assert_eq!(found.status, Status::Cancelled);
    assert_eq!(found.levels.len(), 1);
}
