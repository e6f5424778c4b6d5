//! Paths from several starts.

use fe_grid::minimise::{Objective, SecondOrder, Silent};
use fe_grid::vector::dot;
use fe_grid::{Field, Grid, ScalarField};
use geodesic::{
    DomainChoice, GeodesicError, GeodesicParams, PathMinima, Shape, StablePath, doubts_of_minima,
    geodesic_between, geodesic_from, lagrangian::PathObjective, stable_path,
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

/// A rounder one that stands.
fn standing_ellipse(grid: Grid<2>) -> ScalarField<f64, 2> {
    let lying = ellipse(grid);
    ScalarField::from_fn(grid, |[x, y]| {
        let (along, across) = (0.5 + 1.1 * (y - 0.5), 0.5 + (x - 0.5) / 1.1);
        lying.sample([along, across])
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
    let usual = geodesic_between(&start, &end, &params, &mut Silent).unwrap();
    assert!(minima.add(stable_path(&start, &end, usual, &params, &mut Silent).unwrap()));
    let quarter = std::f64::consts::FRAC_PI_2;
    // The last start is near the first path, and ends there.
    for angle in [quarter, -quarter, 0.2] {
        let first = turned(coarsest, angle, 2);
        let path = geodesic_from(&start, &end, &first, &params, &mut Silent).unwrap();
        assert!(path.end_reached(), "{angle}");
        minima.add(stable_path(&start, &end, path, &params, &mut Silent).unwrap());
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
    let causes = |list| -> Vec<Cause> { doubts_of_minima(list).iter().map(|d| d.cause).collect() };
    assert_eq!(causes(&list), [Cause::AmbiguousPath]);
    assert_eq!(causes(&list[..1]), []);
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
    assert!(minima.add(stable_path(&start, &end, far, &params, &mut Silent).unwrap()));
    let usual = geodesic_between(&start, &end, &params, &mut Silent).unwrap();
    assert!(minima.add(stable_path(&start, &end, usual, &params, &mut Silent).unwrap()));
    let (best, list) = minima.finish().unwrap();
    assert!(best.length() < 0.1 * length, "{} {length}", best.length());
    assert_eq!(list.len(), 2, "{list:?}");
    assert_eq!(list[0].starts, [2]);
    // The path at rest has no length, and the excess is a number.
    assert!(
        list[1].excess > 1.0 && list[1].excess.is_finite(),
        "{list:?}"
    );
    assert_eq!(doubts_of_minima(&list), []);
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

/// An ellipse that stands from one that lies. By symmetry the path stretches it; it takes less to turn it, to
/// the left or to the right, and every mixture of both takes less than stretching alone: the deformation `M(phi)` of one ellipse
/// into the other that takes the points by an angle `phi` around costs `C s^2`, `cosh 2s = cos^2 phi cosh 2s_0 +
/// sin^2 phi`, where `exp s_0` is the ratio of the half-axes: a maximum at `phi = 0`.
#[test]
fn a_path_that_stretches_in_place_of_turning_is_left() {
    let grid = Grid::<2>::cube(33);
    let [start, end] = [ellipse(grid), standing_ellipse(grid)].map(Shape::new);
    let params = GeodesicParams {
        steps: 2,
        ..GeodesicParams::default()
    };
    let identity = turned(grid.hierarchy(params.coarsest_nodes)[0], 0.0, 2);
    let path = geodesic_from(&start, &end, &identity, &params, &mut Silent).unwrap();
    assert!(path.end_reached());
    let stretched = path.length();
    let found = stable_path(&start, &end, path, &params, &mut Silent).unwrap();
    assert_eq!(found.saddles, 1);
    // A turn alone has no length, and the end is nearer to a turned start than to the start.
    let StablePath {
        path, curvature, ..
    } = found;
    assert!(path.end_reached());
    assert!(path.length() < 0.4 * stretched, "{}", path.length());
    let curvature = curvature.unwrap();
    assert!(curvature.value > 0.0, "{curvature:?}");
    // The energy itself has the curvature of the Hessian, up to the kinks of the mismatch.
    let measured = curvature.measured.unwrap();
    assert!(
        (0.5..3.0).contains(&(measured / curvature.value)),
        "{curvature:?}"
    );
    // Levels before and after the saddle point.
    let before = grid.hierarchy(params.coarsest_nodes).len();
    assert!(path.levels.len() > before);
    // By default it turns, on either domain.
    for domain in [DomainChoice::Start, DomainChoice::End] {
        let params = GeodesicParams {
            domain,
            ..params.clone()
        };
        let path = geodesic_between(&start, &end, &params, &mut Silent).unwrap();
        assert!(path.length() < 0.4 * stretched, "{}", path.length());
        let found = stable_path(&start, &end, path, &params, &mut Silent).unwrap();
        assert_eq!(found.saddles, 0);
    }
}

/// The action is that of the energy, whose elastic part is smooth: it agrees with the difference of two
/// gradients without a mismatch, and is symmetric.
#[test]
fn the_action_of_the_hessian_is_symmetric() {
    let grid = Grid::<2>::cube(17);
    let params = GeodesicParams::default();
    let end = flower(grid, 0.0);
    let mut objective = PathObjective::new(end.clone(), end, 2, &params).unwrap();
    let dim = objective.dim();
    let smooth = |seed: f64| -> Vec<f64> {
        let fields = (0..2).map(|k| {
            Field::<f64, 2, 2>::from_fn(grid, |[x, y]| {
                let phase = seed + f64::from(k);
                [(3.0 * x + phase).sin() * y, (2.0 * y - phase).cos() * x]
            })
        });
        fields.flat_map(Field::into_vec).collect()
    };
    let x: Vec<f64> = smooth(0.3).iter().map(|v| 0.02 * v).collect();
    let [a, b] = [smooth(1.0), smooth(2.5)];
    let mut images = [vec![0.0; dim], vec![0.0; dim]];
    objective.hessian_action(&x, &a, &mut images[0]).unwrap();
    objective.hessian_action(&x, &b, &mut images[1]).unwrap();
    let (ab, ba) = (dot(&b, &images[0]), dot(&a, &images[1]));
    let scale = (dot(&a, &images[0]) * dot(&b, &images[1])).abs().sqrt();
    // The kinks of the mismatch are met by both steps in other places.
    assert!((ab - ba).abs() < 0.05 * scale, "{ab} {ba} {scale}");
    // Along a, the second difference of the energy.
    let step = 0.01;
    let mut energy = |t: f64| {
        let moved: Vec<f64> = x.iter().zip(&a).map(|(x, a)| x + t * a).collect();
        objective.value(&moved).unwrap().energy().unwrap()
    };
    let second = (energy(step) + energy(-step) - 2.0 * energy(0.0)) / (step * step);
    let action = dot(&a, &images[0]);
    assert!((action / second - 1.0).abs() < 0.1, "{action} {second}");
}

/// The doubts follow the figures.
#[test]
fn a_falling_energy_is_a_doubt() {
    let grid = Grid::<2>::cube(17);
    let [start, end] = [ellipse(grid), standing_ellipse(grid)].map(Shape::new);
    let params = GeodesicParams {
        steps: 1,
        ..GeodesicParams::default()
    };
    let path = geodesic_between(&start, &end, &params, &mut Silent).unwrap();
    let mut minima = PathMinima::new();
    minima.add(stable_path(&start, &end, path, &params, &mut Silent).unwrap());
    let (_, mut list) = minima.finish().unwrap();
    assert_eq!(doubts_of_minima(&list), []);
    list[0].least_eigenvalue.as_mut().unwrap().fall = 0.05;
    let doubts = doubts_of_minima(&list);
    assert_eq!(doubts.len(), 1);
    assert_eq!(doubts[0].cause, Cause::Saddle);
}
