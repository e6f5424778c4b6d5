//! Paths from several starts.

use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid, ScalarField};
use geodesic::{
    GeodesicError, GeodesicParams, PathMinima, Shape, doubts_of_minima, geodesic_between,
    geodesic_from,
};
use levelset::Cause;

/// A flower of four petals, of which one may be longer; without that a quarter turn maps it to itself.
fn flower(grid: Grid<2>, longer: f64) -> ScalarField<f64, 2> {
    ScalarField::from_fn(grid, |[x, y]| {
        let (x, y) = (x - 0.5, y - 0.5);
        let around = y.atan2(x);
        [0.2 + 0.03 * (4.0 * around).cos() + longer * around.cos() - x.hypot(y)]
    })
}

/// An ellipse that lies, its distance to first order.
fn ellipse(grid: Grid<2>) -> ScalarField<f64, 2> {
    let (a, b) = (0.26f64, 0.16f64);
    ScalarField::from_fn(grid, |[x, y]| {
        let (x, y) = (x - 0.5, y - 0.5);
        let q = (x / a).hypot(y / b);
        let slope = (x / (a * a)).hypot(y / (b * b));
        [if q > 1e-9 { (1.0 - q) * q / slope } else { b }]
    })
}

/// Turns by shares of an angle about the middle of the box.
fn turned(grid: Grid<2>, angle: f64, steps: usize) -> Vec<Field<f64, 2, 2>> {
    let turn = |k: usize| {
        let (sin, cos) = (angle * k as f64 / steps as f64).sin_cos();
        Field::from_fn(grid, |[x, y]| {
            let (x, y) = (x - 0.5, y - 0.5);
            [cos * x - sin * y - x, sin * x + cos * y - y]
        })
    };
    (1..=steps).map(turn).collect()
}

#[test]
fn symmetric_shapes_have_several_paths_of_one_length() {
    let grid = Grid::<2>::cube(33);
    let [start, end] = [flower(grid, 0.0), ellipse(grid)].map(Shape::new);
    let params = GeodesicParams {
        steps: 2,
        ..GeodesicParams::default()
    };
    let coarsest = grid.hierarchy(params.coarsest_nodes)[0];
    let mut minima = PathMinima::new();
    assert!(minima.add(geodesic_between(&start, &end, &params, &mut Silent).unwrap()));
    let quarter = std::f64::consts::FRAC_PI_2;
    // The last start is near the first path, and ends there.
    for angle in [quarter, -quarter, 0.2] {
        let first = turned(coarsest, angle, 2);
        let path = geodesic_from(&start, &end, &first, &params, &mut Silent).unwrap();
        assert!(path.end_reached(), "{angle}");
        minima.add(path);
    }
    let (best, list) = minima.finish().unwrap();
    assert_eq!(list.len(), 3, "{list:?}");
    assert_eq!(list[0].starts, [1, 4], "{list:?}");
    for other in &list[1..] {
        // The same path, turned: the grid is as symmetric as the flower. Both domains are tried for the first.
        assert!(other.excess.abs() < 0.02, "{list:?}");
        // Chords of a quarter turn are sqrt 2 of the radius.
        assert!((other.distance - 2f64.sqrt()).abs() < 0.05, "{list:?}");
    }
    assert!((list[0].length - best.length()).abs() < 1e-12);
    let doubt = doubts_of_minima(&list).unwrap();
    assert_eq!(doubt.cause, Cause::AmbiguousPath);
    assert!(doubts_of_minima(&list[..1]).is_none());
}

/// A longer path is listed, and is no reason for doubt.
#[test]
fn the_shorter_path_is_kept() {
    let grid = Grid::<2>::cube(33);
    // A flower onto itself: at rest, or each petal onto the next.
    let [start, end] = [flower(grid, 0.02), flower(grid, 0.02)].map(Shape::new);
    let params = GeodesicParams {
        steps: 4,
        ..GeodesicParams::default()
    };
    let coarsest = grid.hierarchy(params.coarsest_nodes)[0];
    let mut minima = PathMinima::new();
    let quarter = turned(coarsest, std::f64::consts::FRAC_PI_2, 4);
    let far = geodesic_from(&start, &end, &quarter, &params, &mut Silent).unwrap();
    let length = far.length();
    assert!(minima.add(far));
    assert!(minima.add(geodesic_between(&start, &end, &params, &mut Silent).unwrap()));
    let (best, list) = minima.finish().unwrap();
    assert!(best.length() < 0.1 * length, "{} {length}", best.length());
    assert_eq!(list.len(), 2, "{list:?}");
    assert_eq!(list[0].starts, [2]);
    // The path at rest has no length, and the excess is a number.
    assert!(
        list[1].excess > 1.0 && list[1].excess.is_finite(),
        "{list:?}"
    );
    assert!(doubts_of_minima(&list).is_none());
}

#[test]
fn deformations_that_do_not_fit_are_refused() {
    let grid = Grid::<2>::cube(33);
    let [start, end] = [flower(grid, 0.0), ellipse(grid)].map(Shape::new);
    let params = GeodesicParams {
        steps: 2,
        ..GeodesicParams::default()
    };
    for first in [
        turned(grid, 0.1, 3),
        turned(Grid::cube(9), 0.1, 2),
        Vec::new(),
    ] {
        let found = geodesic_from(&start, &end, &first, &params, &mut Silent);
        assert!(matches!(found, Err(GeodesicError::Given)));
    }
}
