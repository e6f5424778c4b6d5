//! Slits and films of boundaries.

use levelset::{Contour, Layer, facing};
use proptest::prelude::*;
use test_support::cuboid;

/// A counter-clockwise polygon, every edge divided into pieces.
fn polygon(corners: &[[f64; 2]], pieces: u32) -> Contour<2> {
    let mut points = Vec::new();
    for (i, a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        for piece in 0..pieces {
            let t = f64::from(piece) / f64::from(pieces);
            points.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
        }
    }
    let n = points.len() as u32;
    let segments = (0..n).map(|i| [i, (i + 1) % n]).collect();
    Contour::new(points, segments).unwrap()
}

fn rectangle(low: [f64; 2], high: [f64; 2]) -> Contour<2> {
    polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]], 40)
}

/// The length of the pieces of one kind.
fn length(contour: &Contour<2>, width: f64, kind: Layer) -> f64 {
    let found = facing(contour, width).unwrap();
    let all = contour.simplices().iter().zip(found);
    let kept = all
        .filter(|(_, found)| found.across(kind).is_some())
        .map(|(s, _)| *s);
    let part = Contour::new(contour.points().to_vec(), kept.collect());
    part.unwrap().perimeter()
}

/// Whether a length is expected: within half a width of the four ends of two sides another side may be
/// nearer than the opposite one, and pieces count as a whole.
fn is_all_but_the_ends(found: f64, expected: f64, width: f64) -> bool {
    found <= expected + 1e-9 && found >= expected - 4.0 * (0.5 * width + 0.015)
}

proptest! {
    #[test]
    fn two_blocks_have_a_slit_between_them_if_it_is_narrow(gap in 0.002..0.06_f64) {
        let width = 0.03;
        prop_assume!((gap - width).abs() > 1e-6);
        let right = rectangle([0.5, 0.3], [0.8, 0.7]);
        let blocks = rectangle([0.2, 0.3], [0.5 - gap, 0.7]).joined(&right);
        let slit = length(&blocks, width, Layer::Slit);
        let expected = if gap < width { 0.8 } else { 0.0 };
        prop_assert!(is_all_but_the_ends(slit, expected, width), "{slit}");
        prop_assert_eq!(length(&blocks, width, Layer::Film), 0.0);
    }

    #[test]
    fn a_plate_is_a_film_if_it_is_thin(thickness in 0.002..0.06_f64) {
        let width = 0.03;
        prop_assume!((thickness - width).abs() > 1e-6);
        let plate = rectangle([0.5 - thickness, 0.2], [0.5, 0.8]);
        let film = length(&plate, width, Layer::Film);
        // The long sides: the ends of the plate have opposite sides that are far away.
        let expected = if thickness < width { 1.2 } else { 0.0 };
        prop_assert!(is_all_but_the_ends(film, expected, width), "{film}");
        prop_assert_eq!(length(&plate, width, Layer::Slit), 0.0);
    }
}

#[test]
fn walls_of_a_wedge_face_each_other_where_it_is_narrow() {
    // A cut from the right side to the middle of a square, open by .1 at its mouth.
    let square = polygon(
        &[
            [0.2, 0.2],
            [0.8, 0.2],
            [0.8, 0.45],
            [0.5, 0.5],
            [0.8, 0.55],
            [0.8, 0.8],
            [0.2, 0.8],
        ],
        60,
    );
    let slit = length(&square, 0.05, Layer::Slit);
    // The sides see each other.
    for (i, found) in facing(&square, 0.05).unwrap().iter().enumerate() {
        let other = found.slit.map(|other| square.corners(other)[0]);
        let across = other.map(|p| (p[1] - 0.5) * (square.corners(i)[0][1] - 0.5));
        assert!(across.is_none_or(|product| product <= 1e-12));
    }
    // Half of both walls, up to the direction in which the width is measured.
    let wall = 0.3_f64.hypot(0.05);
    assert!((slit - wall).abs() < 0.1 * wall, "{slit}");
}

/// Two plates with a gap between them, all of a hundredth: the sides of the gap face each other across it, and
/// each the far side of its own plate. A point half a width ahead of a side lies behind three more sides.
#[test]
fn all_layers_of_a_stack_are_found() {
    let width = 0.05;
    let low = rectangle([0.2, 0.5], [0.8, 0.51]);
    let plates = low.joined(&rectangle([0.2, 0.52], [0.8, 0.53]));
    let (slit, film) = (
        length(&plates, width, Layer::Slit),
        length(&plates, width, Layer::Film),
    );
    assert!(is_all_but_the_ends(slit, 1.2, width), "{slit}");
    assert!(is_all_but_the_ends(film, 2.4, 2.0 * width), "{film}");
}

#[test]
fn the_layer_between_two_boxes_is_a_slit() {
    let block = |low: [f64; 3], high: [f64; 3]| {
        let (points, triangles) = cuboid(low, high);
        Contour::new(points, triangles).unwrap()
    };
    let far = block([0.5, 0.3, 0.3], [0.8, 0.7, 0.7]);
    let blocks = block([0.2, 0.3, 0.3], [0.49, 0.7, 0.7]).joined(&far);
    let area = |width: f64| {
        let found = facing(&blocks, width).unwrap();
        assert!(found.iter().all(|f| f.film.is_none()));
        let all = blocks.simplices().iter().zip(found);
        let slits = all.filter(|(_, found)| found.slit.is_some());
        let part = Contour::new(blocks.points().to_vec(), slits.map(|(s, _)| *s).collect());
        part.unwrap().perimeter()
    };
    assert!((area(0.02) - 2.0 * 0.16).abs() < 1e-12, "{}", area(0.02));
    assert_eq!(area(0.005), 0.0);
}
