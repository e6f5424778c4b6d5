//! Starts of paths from the transport of the volume, where the mismatch leads elsewhere.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use geodesic::{
    Geodesic, GeodesicParams, Known, Shape, geodesic_between, geodesics_both_ways, transport_cost,
};
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

/// The tips of all fingers of one hand are hidden: without a transport, two of them are cut off where they are seen.
#[test]
fn fingers_become_their_own_where_tips_are_hidden() {
    let nodes = 65;
    let view = ScalarField::from_fn(Grid::cube(nodes), |[_, y]| [f64::from(u8::from(y < 0.6))]);
    let seen = |hand: Shape<2>| hand.with_known(Known::Within(view.clone()));
    let (a, b) = (hand(nodes, &STRAIGHT), hand(nodes, &TURNED));
    let whole = geodesic_between(&a, &b, &params(), &mut Silent).unwrap();
    let hidden = [
        geodesic_between(&a, &seen(b.clone()), &params(), &mut Silent).unwrap(),
        geodesic_between(&seen(a), &b, &params(), &mut Silent).unwrap(),
    ];
    for path in &hidden {
        assert!(path.end_reached());
        // Less than the radius of a finger: without a transport, two of them grow anew.
        let misses = misses(path, &STRAIGHT, &TURNED);
        assert!(misses.iter().all(|miss| *miss < 0.035), "{misses:?}");
        // What is hidden costs nothing; the valley that is found is nearly that of the whole hands, and others are three
        // times as long.
        let ratio = path.length() / whole.length();
        assert!((0.5..1.25).contains(&ratio), "{ratio}");
    }
}

/// The union of thick segments, each given by its ends and its radius.
fn segments(nodes: usize, parts: &[([f64; 2], [f64; 2], f64)]) -> ScalarField<f64, 2> {
    let implicit = ScalarField::<f64, 2>::from_fn(Grid::cube(nodes), |[x, y]| {
        let part = |(a, b, radius): &([f64; 2], [f64; 2], f64)| {
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let along = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy);
            let along = along.clamp(0.0, 1.0);
            radius - (x - a[0] - along * dx).hypot(y - a[1] - along * dy)
        };
        [parts.iter().map(part).fold(f64::MIN, f64::max)]
    });
    signed_distance(&implicit, 0.0).unwrap()
}

/// A trunk with an arm and two legs; the points are the hand and the feet.
fn figure(nodes: usize, hand: [f64; 2], feet: [[f64; 2]; 2]) -> Shape<2> {
    let (hip, elbow) = ([0.55, 0.35], [0.3, 0.62]);
    Shape::new(segments(
        nodes,
        &[
            (hip, [0.55, 0.8], 0.07),
            ([0.55, 0.68], elbow, 0.028),
            (elbow, hand, 0.028),
            (hip, feet[0], 0.035),
            (hip, feet[1], 0.035),
        ],
    ))
}

/// A robot's arm on its base, with the directions of its three parts in degrees.
fn robot(degrees: [f64; 3]) -> ScalarField<f64, 2> {
    let mut parts = vec![([0.33, 0.12], [0.67, 0.12], 0.05)];
    let mut joint = [0.5, 0.17];
    for ((degrees, length), radius) in degrees
        .iter()
        .zip([0.25, 0.21, 0.15])
        .zip([0.04, 0.032, 0.025])
    {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let next = [joint[0] + length * cos, joint[1] + length * sin];
        parts.push((joint, next, radius));
        joint = next;
    }
    segments(65, &parts)
}

/// The mean of the nodes inside.
fn centre(shape: &ScalarField<f64, 2>) -> [f64; 2] {
    let grid = shape.grid();
    let inside = (0..grid.n_nodes()).filter(|&i| shape.as_slice()[i] > 0.0);
    let points: Vec<_> = inside.map(|i| grid.position(grid.node(i))).collect();
    std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64)
}

/// A shape that is turned about its centre and moved onto that of another one.
fn turned_onto(
    shape: &ScalarField<f64, 2>,
    other: &ScalarField<f64, 2>,
    degrees: f64,
) -> ScalarField<f64, 2> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let (own, to) = (centre(shape), centre(other));
    ScalarField::from_fn(*shape.grid(), |[x, y]| {
        let (x, y) = (x - to[0], y - to[1]);
        shape.sample([own[0] + cos * x + sin * y, own[1] - sin * x + cos * y])
    })
}

/// Upside down, the base of a robot overlaps the gripper that has swung aside, and points move less; distances within
/// the robot tell the poses apart.
#[test]
fn a_transport_tells_a_robot_from_one_upside_down() {
    let (straight, swung) = (robot([90.0, 45.0, 0.0]), robot([60.0, 140.0, 190.0]));
    let least = |around: f64| {
        let poses = [-30.0, -15.0, 0.0, 15.0, 30.0].map(|by| around + by);
        let cost = |degrees| transport_cost(&turned_onto(&straight, &swung, degrees), &swung);
        poses
            .map(|degrees| cost(degrees).unwrap())
            .into_iter()
            .fold(f64::MAX, f64::min)
    };
    // By distances in space alone the wrong pose costs a third of the right one.
    let (right, wrong) = (least(0.0), least(180.0));
    assert!(right < 0.8 * wrong, "{right} {wrong}");
}

/// An arm that swings by 150 degrees at the elbow is not drawn in to grow again elsewhere.
#[test]
fn a_raised_arm_keeps_its_length() {
    let hands = [[0.28, 0.38], [0.26, 0.86]];
    let (nodes, right) = (65, [0.65, 0.05]);
    let (a, b) = (
        figure(nodes, hands[0], [[0.47, 0.05], right]),
        figure(nodes, hands[1], [[0.27, 0.22], right]),
    );
    for (start, end, from, to) in [(&a, &b, hands[0], hands[1]), (&b, &a, hands[1], hands[0])] {
        let path = geodesic_between(start, end, &params(), &mut Silent).unwrap();
        let last = &path.motions[path.motions.len() - 1];
        let u = last.sample(from);
        let missed = (from[0] + u[0] - to[0]).hypot(from[1] + u[1] - to[1]);
        // Less than the width of the arm.
        assert!(
            path.end_reached() && missed < 0.056,
            "{missed} {}",
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
