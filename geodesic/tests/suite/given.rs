//! Lengths and dissipations of given paths.

use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid, ScalarField};
use geodesic::{DomainChoice, GeodesicParams, GivenPath, Shape, geodesic, geodesic_from};
use levelset::{Cause, signed_distance};
use std::f64::consts::PI;

fn ellipse(axes: [f64; 2], angle: f64) -> Shape<2> {
    ellipse_on(5, axes, angle)
}

fn ellipse_on(level: u32, axes: [f64; 2], angle: f64) -> Shape<2> {
    let (sin, cos) = f64::sin_cos(angle);
    let implicit = ScalarField::from_fn(Grid::dyadic(level), |[x, y]| {
        let [x, y] = [x - 0.5, y - 0.5];
        let (across, along) = (cos * x + sin * y, cos * y - sin * x);
        [axes[0].min(axes[1]) * (1.0 - (across / axes[0]).hypot(along / axes[1]))]
    });
    Shape::new(signed_distance(&implicit, 0.0).unwrap())
}

fn params(steps: usize) -> GeodesicParams {
    GeodesicParams {
        steps,
        // A given path has a direction, and its dissipation one domain a step.
        domain: DomainChoice::Start,
        ..GeodesicParams::default()
    }
}

fn given(shapes: &[Shape<2>], steps: usize) -> GivenPath<2> {
    let found = GivenPath::new(shapes, &params(steps), &mut Silent).unwrap();
    assert_eq!(found.pieces.len(), shapes.len() - 1);
    assert_eq!(found.step_energies().len(), steps * (shapes.len() - 1));
    assert!(found.certificate().certified);
    found
}

/// The shapes of a geodesic, given as a path, have its length: each step is then minimal by itself.
#[test]
fn a_geodesic_has_its_own_length() {
    let (start, end) = (ellipse([0.2, 0.2], 0.0), ellipse([0.3, 0.24], 0.0));
    let [from, to] = [&start, &end].map(|shape| &shape.components()[0]);
    let path = geodesic(from, to, &params(3), &mut Silent).unwrap();
    let between = path.level_sets[1..3].iter();
    let between = between.map(|u| Shape::new(signed_distance(u, 0.0).unwrap()));
    let shapes: Vec<_> = [start.clone()]
        .into_iter()
        .chain(between)
        .chain([end.clone()])
        .collect();
    let film = given(&shapes, 1);
    // Each of the steps may end a twentieth of a cell of 1/32 before its shape, with that part of its
    // length of .035: the mismatch has a finite weight.
    let ratio = film.length() / path.length();
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    assert!((film.dissipation() / path.dissipation() - 1.0).abs() < 0.1);
    assert!(film.doubts(&params(1)).is_empty());
}

/// The time of a path is shared evenly: a pause costs dissipation, and no length.
#[test]
fn a_pause_costs_dissipation_only() {
    let (small, large) = (ellipse([0.2, 0.2], 0.0), ellipse([0.26, 0.26], 0.0));
    let once = given(&[small.clone(), large.clone()], 1);
    let paused = given(&[small.clone(), large.clone(), large.clone()], 1);
    // What moves where both shapes are equal is rounding and the smoothing of their corners.
    assert!((paused.length() / once.length() - 1.0).abs() < 1e-3);
    assert!((paused.dissipation() / once.dissipation() - 2.0).abs() < 1e-3);
    let back = given(&[small.clone(), large, small], 1);
    // There and back have the same length in the limit of small steps; these are of a quarter.
    assert!(
        (back.length() / once.length() - 2.0).abs() < 0.2,
        "{}",
        back.length() / once.length()
    );
}

/// A detour is longer than the geodesic between its ends; a rotation has no length.
#[test]
fn detours_are_longer_and_rotations_are_free() {
    let (start, end) = (ellipse([0.2, 0.2], 0.0), ellipse([0.25, 0.25], 0.0));
    let straight = given(&[start.clone(), end.clone()], 2);
    let detour = given(&[start, ellipse([0.3, 0.18], 0.0), end], 1);
    assert!(
        detour.length() > 1.3 * straight.length(),
        "{}",
        detour.length()
    );
    // On 33 nodes a side the discrete mismatch has minima of several rotations.
    let turned: Vec<_> = [0.0, 0.15, 0.3]
        .map(|angle| ellipse_on(6, [0.3, 0.2], angle))
        .into();
    let turns = given(&turned, 1);
    // The shear of an ellipse that would do the same without rotation has a length of about .05.
    assert!(
        turns.length() < 0.02 * straight.length(),
        "{}",
        turns.length()
    );
}

/// A rod that turns past an axis of the box is longer than that: its caps are outside then, two half disks.
#[test]
fn shapes_that_leave_the_box_are_doubtful() {
    let grid = Grid::<2>::cube(65);
    let (reach, radius) = (0.5, 0.06);
    let rod = |degrees: f64, reach: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let distance = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| {
            let [x, y] = [x - 0.5, y - 0.5];
            let along = (x * cos + y * sin).clamp(-reach, reach);
            [radius - (x - along * cos).hypot(y - along * sin)]
        });
        Shape::new(distance)
    };
    let turned = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Field::from_fn(grid, |[x, y]| {
            let [x, y] = [x - 0.5, y - 0.5];
            [cos * x - sin * y - x, sin * x + cos * y - y]
        })
    };
    let outside = |reach: f64| {
        let ends = [rod(-35.0, reach), rod(35.0, reach)];
        let turns = [turned(35.0), turned(70.0)];
        let params = params(2);
        let path = geodesic_from(&ends[0], &ends[1], &turns, &params, &mut Silent).unwrap();
        let doubts = path.doubts(&params);
        let doubt = doubts.iter().find(|doubt| doubt.cause == Cause::OutsideBox);
        assert_eq!(doubt.map_or(0.0, |doubt| doubt.figure), path.outside);
        path.outside
    };
    let caps = PI * radius * radius;
    let share = caps / (4.0 * reach * radius + caps);
    // The polygon of the caps lacks a hundredth of them, and the path may shift the rod by a tenth of a cell.
    assert!((outside(reach) / share - 1.0).abs() < 0.05);
    assert_eq!(outside(0.4), 0.0);
}

/// A path that is known to be short is the start of another minimisation, of which the end is no longer.
#[test]
fn the_geodesic_in_the_valley_of_a_path_is_no_longer() {
    let shapes: Vec<_> = (0..=4)
        .map(|k| ellipse([0.3, 0.14], 0.55 * f64::from(k)))
        .collect();
    let params = params(1);
    let film = given(&shapes, 1);
    let found = film.shortened(&shapes[0], &shapes[4], &params, &mut Silent);
    let found = found.unwrap().unwrap();
    assert!(found.end_reached(), "{}", found.dice_end);
    assert_eq!(found.energy.step_energies.len(), 4);
    // By 126 degrees: rotations cost nothing but for the grid, of which one has errors in every piece.
    assert!(
        found.length() < 1.05 * film.length(),
        "{} {}",
        found.length(),
        film.length()
    );
    assert!(
        found
            .rotation_degrees
            .is_some_and(|angle| (angle - 126.0).abs() < 8.0)
    );
    let level_sets = GivenPath::<2> { pieces: Vec::new() };
    let none = level_sets.shortened(&shapes[0], &shapes[4], &params, &mut Silent);
    assert!(none.is_err());
}
