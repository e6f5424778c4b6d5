//! Starts of paths from the transport of the volume, where the mismatch leads elsewhere.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use geodesic::{Geodesic, GeodesicParams, Shape, geodesic_between, geodesics_both_ways};
use levelset::signed_distance;

const WRIST: [f64; 2] = [0.5, 0.25];
const REACH: f64 = 0.5;

fn tip(degrees: f64) -> [f64; 2] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [WRIST[0] + REACH * cos, WRIST[1] + REACH * sin]
}

/// A palm with fingers in these directions.
fn hand(nodes: usize, degrees: &[f64]) -> Shape<2> {
    let implicit = ScalarField::<f64, 2>::from_fn(Grid::cube(nodes), |[x, y]| {
        let [x, y] = [x - WRIST[0], y - WRIST[1]];
        let finger = |degrees: &f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let along = (x * cos + y * sin).clamp(0.0, REACH);
            0.035 - (x - along * cos).hypot(y - along * sin)
        };
        let palm = 0.2 - x.hypot(y);
        [degrees.iter().map(finger).fold(palm, f64::max)]
    });
    Shape::new(signed_distance(&implicit, 0.0).unwrap())
}

fn params() -> GeodesicParams {
    GeodesicParams {
        steps: 2,
        ..GeodesicParams::default()
    }
}

/// How far the tips of the fingers of one hand end from those of the other one.
fn misses(path: &Geodesic<2>, from: &[f64], to: &[f64]) -> Vec<f64> {
    let last = &path.motions[path.motions.len() - 1];
    let pairs = from.iter().zip(to);
    pairs
        .map(|(from, to)| {
            let (x, goal) = (tip(*from), tip(*to));
            let u = last.sample(x);
            (x[0] + u[0] - goal[0]).hypot(x[1] + u[1] - goal[1])
        })
        .collect()
}

const STRAIGHT: [f64; 4] = [50.0, 75.0, 100.0, 125.0];
/// The third finger is where the fourth was.
const TURNED: [f64; 4] = [50.0, 75.0, 125.0, 150.0];

#[test]
fn every_finger_becomes_its_own() {
    let nodes = 65;
    let (a, b) = (hand(nodes, &STRAIGHT), hand(nodes, &TURNED));
    for (start, end, from, to) in [(&a, &b, STRAIGHT, TURNED), (&b, &a, TURNED, STRAIGHT)] {
        let path = geodesic_between(start, end, &params(), &mut Silent).unwrap();
        assert!(
            path.end_reached() && path.contacts.is_empty(),
            "{:?}",
            path.contacts
        );
        // Less than the radius of a finger.
        let misses = misses(&path, &from, &to);
        assert!(
            misses.iter().all(|miss| *miss < 0.035),
            "{misses:?} {}",
            path.length()
        );
    }
}

/// The lengths of both directions are the same whichever shape is called the start.
#[test]
fn the_order_of_two_shapes_does_not_matter() {
    let (a, b) = (hand(33, &STRAIGHT), hand(33, &TURNED));
    let [forth, back] = geodesics_both_ways(&a, &b, &params(), &mut Silent).unwrap();
    let [again_back, again_forth] = geodesics_both_ways(&b, &a, &params(), &mut Silent).unwrap();
    let lengths = [&forth, &back, &again_forth, &again_back].map(|path| path.length().to_bits());
    assert_eq!(lengths[..2], lengths[2..]);
    assert_ne!(lengths[0], lengths[1]);
}
