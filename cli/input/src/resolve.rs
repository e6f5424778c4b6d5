//! The boundary of what closed curves enclose, where these cross, or lie on each other.
//!
//! Distances are those to the boundary of the object, to which no part of a curve belongs that has the object on
//! both sides: such as the common edge of two adjacent rectangles, which would be a slit. Curves are cut into
//! pieces ([`Arrangement`]), and those are kept that have the object on one side.

use std::collections::BTreeMap;

use levelset::Contour;

use super::arrangement::{Arrangement, Budget, Piece};
use super::filled::Filled;
use super::nearby::{Tree, around};
use super::winding::Fill;

/// Points nearer to each other than this share of the diagonal are one.
const SAME: f64 = 4e-10;
/// And so are those nearer than as many roundings of the largest coordinate.
const ROUNDINGS: f64 = 8.0;
/// Pairs of segments, and of a segment and a line, that are compared.
const MOST_PAIRS: usize = 1 << 28;

/// What closed curves are to the boundary of what they enclose.
pub(crate) enum Resolved {
    /// They neither cross, nor lie on each other.
    Apart,
    /// They do, and this is the boundary, the object to its left; it is empty where nothing is enclosed.
    Boundary(Contour<2>),
    /// They are too many, or too close to each other, to tell.
    Unknown,
}

/// A piece of one or more curves.
struct Edge {
    ends: [u32; 2],
    /// How often each part goes from the first end to the second, less how often it goes back.
    passes: Vec<(u32, i32)>,
    /// The segments of which it is a piece, and whether it has their direction.
    sources: Vec<(u32, bool)>,
}

/// On which side of an edge, from its first end to its second, the object lies.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    Left,
    Right,
    /// On both or on none.
    Same,
}

/// The boundary of what closed curves enclose.
pub(crate) fn resolved(filled: &Filled<2>) -> Resolved {
    boundary(filled).unwrap_or(Resolved::Unknown)
}

fn boundary(filled: &Filled<2>) -> Option<Resolved> {
    let whole = filled.whole();
    let [low, high] = whole.bounds();
    let largest = low
        .iter()
        .chain(&high)
        .fold(0.0, |m: f64, x| m.max(x.abs()));
    let diagonal = (high[0] - low[0]).hypot(high[1] - low[1]);
    let tolerance = (SAME * diagonal).max(ROUNDINGS * f64::EPSILON * largest);
    let mut budget = Budget(MOST_PAIRS);
    let all = Arrangement::new(whole.points(), whole.simplices(), tolerance, &mut budget)?;
    let edges = edges(&all.pieces, &parts(filled));
    let sides = sides(&all.points, &edges, filled, &mut budget)?;
    if !all.crosses && edges.iter().all(|edge| edge.sources.len() == 1) && agree(&edges, &sides) {
        return Some(Resolved::Apart);
    }
    let mut numbers = BTreeMap::new();
    let mut points = Vec::new();
    let mut number = |end: u32| {
        *numbers.entry(end).or_insert_with(|| {
            points.push(all.points[end as usize]);
            points.len() as u32 - 1
        })
    };
    let mut segments = Vec::new();
    for (edge, side) in edges.iter().zip(&sides) {
        let [a, b] = edge.ends;
        match side {
            Side::Left => segments.push([number(a), number(b)]),
            Side::Right => segments.push([number(b), number(a)]),
            Side::Same => {}
        }
    }
    let contour = Contour::new(points, segments).ok()?;
    contour.is_closed().then_some(Resolved::Boundary(contour))
}

/// The number of the part to which every segment belongs.
fn parts(filled: &Filled<2>) -> Vec<u32> {
    let parts = (0..).zip(filled.parts());
    parts
        .flat_map(|(number, (contour, _))| std::iter::repeat_n(number, contour.simplices().len()))
        .collect()
}

/// The different pieces.
fn edges(pieces: &[Piece], parts: &[u32]) -> Vec<Edge> {
    let mut sorted: Vec<([u32; 2], u32, bool)> = pieces
        .iter()
        .map(|piece| {
            let [a, b] = piece.ends;
            ([a.min(b), a.max(b)], piece.source, a < b)
        })
        .collect();
    sorted.sort_unstable();
    let edge = |equal: &[([u32; 2], u32, bool)]| {
        let mut passes: Vec<(u32, i32)> = Vec::new();
        for &(_, source, forwards) in equal {
            let part = parts[source as usize];
            let step = if forwards { 1 } else { -1 };
            match passes.iter_mut().find(|(other, _)| *other == part) {
                Some((_, passes)) => *passes += step,
                None => passes.push((part, step)),
            }
        }
        Edge {
            ends: equal[0].0,
            passes,
            sources: equal
                .iter()
                .map(|&(_, source, way)| (source, way))
                .collect(),
        }
    };
    sorted.chunk_by(|a, b| a.0 == b.0).map(edge).collect()
}

/// Whether the pieces of every segment have the object on the same side of it.
fn agree(edges: &[Edge], sides: &[Side]) -> bool {
    let mut of_segment = BTreeMap::new();
    edges.iter().zip(sides).all(|(edge, side)| {
        edge.sources.iter().all(|&(source, is_forwards)| {
            let own = match side {
                Side::Left if is_forwards => Side::Left,
                Side::Right if !is_forwards => Side::Left,
                Side::Same => Side::Same,
                _ => Side::Right,
            };
            *of_segment.entry(source).or_insert(own) == own
        })
    })
}

/// Where the object lies at every edge: the line to its middle along the first axis is followed.
fn sides(
    points: &[[f64; 2]],
    edges: &[Edge],
    filled: &Filled<2>,
    budget: &mut Budget,
) -> Option<Vec<Side>> {
    let corners = |edge: &Edge| edge.ends.map(|end| points[end as usize]);
    let tree = Tree::new(edges.iter().map(|e| around(&corners(e), 0.0)).collect());
    let mut numbers = vec![0i32; filled.parts().len()];
    let mut touched: Vec<u32> = Vec::new();
    let mut sides = Vec::with_capacity(edges.len());
    for (own, edge) in edges.iter().enumerate() {
        let [p, q] = corners(edge);
        let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        let line = [[f64::NEG_INFINITY, middle[1]], middle];
        let mut enough = true;
        tree.visit(&line, |other| {
            enough &= budget.spend(1);
            if other == own || !enough {
                return;
            }
            let Some((x, change)) = through(corners(&edges[other]), middle[1]) else {
                return;
            };
            if x < middle[0] {
                for &(part, passes) in &edges[other].passes {
                    numbers[part as usize] += change * passes;
                    touched.push(part);
                }
            }
        });
        if !enough {
            return None;
        }
        touched.extend(edge.passes.iter().map(|&(part, _)| part));
        let inside = |numbers: &[i32]| {
            let holds = |fill: Fill, part: u32| fill.holds(numbers[part as usize]);
            touched
                .iter()
                .any(|&part| holds(filled.parts()[part as usize].1, part))
        };
        // The numbers are those before the edge, or for one along the line those beyond it along the second axis.
        let is_across = (p[1] > middle[1]) != (q[1] > middle[1]);
        let starts_left = if is_across { p[1] < q[1] } else { p[0] < q[0] };
        let start = inside(&numbers);
        for &(part, passes) in &edge.passes {
            numbers[part as usize] += if starts_left { -passes } else { passes };
        }
        let end = inside(&numbers);
        sides.push(match (start, end, starts_left) {
            (true, false, true) | (false, true, false) => Side::Left,
            (true, false, false) | (false, true, true) => Side::Right,
            _ => Side::Same,
        });
        for part in touched.drain(..) {
            numbers[part as usize] = 0;
        }
    }
    Some(sides)
}

/// Where a line along the first axis goes through a segment, and how the winding number changes there.
fn through([p, q]: [[f64; 2]; 2], y: f64) -> Option<(f64, i32)> {
    let above = [p[1] > y, q[1] > y];
    if above[0] == above[1] {
        return None;
    }
    let x = p[0] + (y - p[1]) / (q[1] - p[1]) * (q[0] - p[0]);
    Some((x, if above[0] { 1 } else { -1 }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::winding::{Samples, winding_numbers};
    use levelset::Moments;
    use proptest::prelude::*;

    type Points = Vec<[f64; 2]>;

    fn curve(points: &[[f64; 2]]) -> Contour<2> {
        let n = points.len() as u32;
        let segments = (0..n).map(|i| [i, (i + 1) % n]).collect();
        Contour::new(points.to_vec(), segments).unwrap()
    }

    fn rectangle([x, y]: [f64; 2], [width, height]: [f64; 2]) -> Points {
        let (right, top) = (x + width, y + height);
        vec![[x, y], [right, y], [right, top], [x, top]]
    }

    /// The curves of a table.
    fn table(curves: &[Points]) -> Filled<2> {
        let all = curves.iter().map(|points| curve(points));
        Filled::of_one(all.reduce(|a, b| a.joined(&b)).unwrap(), Fill::EvenOdd)
    }

    /// The shapes of a drawing.
    fn drawing(curves: &[Points], fill: Fill) -> Filled<2> {
        let parts = curves.iter().map(|points| (curve(points), fill));
        Filled::of_parts(parts.collect()).unwrap()
    }

    /// Area and length of the boundary.
    fn measured(filled: &Filled<2>) -> [f64; 2] {
        match resolved(filled) {
            Resolved::Boundary(contour) => {
                assert!(contour.is_closed());
                let area = Moments::of_contour(&contour).map_or(0.0, |m| m.volume);
                [area, contour.perimeter()]
            }
            Resolved::Apart => panic!("the curves are apart"),
            Resolved::Unknown => panic!("the boundary is unknown"),
        }
    }

    fn assert_close(found: [f64; 2], expected: [f64; 2]) {
        for (a, b) in found.into_iter().zip(expected) {
            assert!((a - b).abs() < 1e-7 * b, "{found:?}, not {expected:?}");
        }
    }

    /// Points turned and moved, so that nothing lies along an axis.
    fn turned(points: &[[f64; 2]]) -> Points {
        let (sin, cos) = 0.3f64.sin_cos();
        let place = |p: &[f64; 2]| {
            [
                cos * p[0] - sin * p[1] + 17.1,
                sin * p[0] + cos * p[1] - 3.3,
            ]
        };
        points.iter().map(place).collect()
    }

    #[test]
    fn rectangles_with_a_common_edge_are_one() {
        let first = rectangle([0.0; 2], [40.0, 30.0]);
        let cases = [
            (rectangle([40.0, 0.0], [20.0, 30.0]), [1800.0, 180.0]),
            // A part of an edge, and one that begins at a corner.
            (rectangle([40.0, 8.0], [20.0, 14.0]), [1480.0, 180.0]),
            (rectangle([40.0, 0.0], [20.0, 14.0]), [1480.0, 180.0]),
        ];
        for (second, expected) in cases {
            let mut back = second.clone();
            back.reverse();
            for second in [second, back] {
                let both = [first.clone(), second];
                let all = both.iter().map(|points| turned(points)).collect::<Vec<_>>();
                for curves in [&both[..], &all] {
                    assert_close(measured(&table(curves)), expected);
                    assert_close(measured(&drawing(curves, Fill::NonZero)), expected);
                    assert_close(measured(&drawing(curves, Fill::EvenOdd)), expected);
                }
            }
        }
    }

    #[test]
    fn curves_that_cross_are_filled_by_their_rule() {
        let both = [
            rectangle([0.0; 2], [40.0, 30.0]),
            rectangle([30.0, 5.0], [30.0, 20.0]),
        ];
        let all = both.iter().map(|points| turned(points)).collect::<Vec<_>>();
        for curves in [&both[..], &all] {
            // 10 x 20 of both are common.
            let union = [1600.0, 140.0 + 100.0 - 60.0];
            assert_close(measured(&drawing(curves, Fill::NonZero)), union);
            assert_close(measured(&table(curves)), [1400.0, 240.0]);
            let eight = vec![[0.0, 0.0], [60.0, 40.0], [60.0, 0.0], [0.0, 40.0]];
            let length = 80.0 + 2.0 * 60f64.hypot(40.0);
            assert_close(measured(&table(&[turned(&eight)])), [1200.0, length]);
        }
        // A cross of two bars, of which one has points where the other one crosses it.
        let mut lying = rectangle([0.0, 1.0], [3.0, 1.0]);
        lying.splice(3..3, [[2.0, 2.0], [1.0, 2.0]]);
        lying.splice(1..1, [[1.0, 1.0], [2.0, 1.0]]);
        let bars = [lying, rectangle([1.0, 0.0], [1.0, 3.0])];
        assert_close(measured(&drawing(&bars, Fill::NonZero)), [5.0, 12.0]);
        assert_close(measured(&table(&bars)), [4.0, 16.0]);
    }

    #[test]
    fn what_is_drawn_twice_counts_as_its_rule_says() {
        let both = [(); 2].map(|()| rectangle([1.0; 2], [4.0, 3.0]));
        assert_close(measured(&drawing(&both, Fill::EvenOdd)), [12.0, 14.0]);
        assert!(matches!(resolved(&table(&both)), Resolved::Boundary(c) if c.is_empty()));
        // There and back again.
        let spike = vec![
            [0.0, 0.0],
            [3.0, 0.0],
            [9.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
        ];
        assert_close(measured(&table(&[turned(&spike)])), [9.0, 12.0]);
    }

    #[test]
    fn a_common_arc_of_many_segments_vanishes_within_rounding() {
        let arc = |i: u32| {
            let angle = f64::from(i) * 0.01;
            [angle.cos(), angle.sin()]
        };
        let mut inner: Points = (0..=314).map(arc).collect();
        let mut outer: Points = (0..=314).rev().map(arc).collect();
        for p in &mut outer {
            *p = p.map(|x| x * (1.0 + 1e-14));
        }
        inner.push([0.0, -0.2]);
        outer.extend([[2.0, 0.0], [2.0, 2.0], [-2.0, 2.0], [-2.0, 0.0]]);
        let alone: Points = [&inner[314..], &[arc(0)], &outer[315..]].concat();
        let expected = curve(&alone);
        let area = Moments::of_contour(&expected).unwrap().volume;
        assert_close(
            measured(&table(&[inner, outer])),
            [area, expected.perimeter()],
        );
    }

    #[test]
    fn curves_that_are_apart_or_touch_in_points_stay_as_they_are() {
        let first = rectangle([0.0; 2], [40.0, 30.0]);
        for second in [
            rectangle([50.0, 0.0], [20.0, 30.0]),
            rectangle([10.0, 10.0], [20.0, 10.0]),
            rectangle([40.0, 30.0], [20.0, 20.0]),
            vec![[40.0, 10.0], [50.0, 0.0], [50.0, 20.0]],
        ] {
            let curves = [first.clone(), second];
            assert!(matches!(resolved(&table(&curves)), Resolved::Apart));
            let drawn = drawing(&curves, Fill::NonZero);
            assert!(matches!(resolved(&drawn), Resolved::Apart));
        }
    }

    #[test]
    fn what_needs_too_many_comparisons_is_not_resolved() {
        let both = table(&[
            rectangle([0.0; 2], [4.0, 3.0]),
            rectangle([1.0; 2], [4.0, 3.0]),
        ]);
        let whole = both.whole();
        let (points, segments) = (whole.points(), whole.simplices());
        assert!(Arrangement::new(points, segments, 1e-9, &mut Budget(3)).is_none());
    }

    proptest! {
        /// Curves through few different points have all kinds of crossings and of common edges.
        #[test]
        fn the_boundary_encloses_what_the_curves_do(
            curves in prop::collection::vec(
                prop::collection::vec(prop::array::uniform2(0..6i32), 3..9),
                1..5,
            ),
            are_parts in any::<bool>(),
            rule in prop::sample::select(vec![Fill::NonZero, Fill::EvenOdd]),
            is_turned in any::<bool>(),
        ) {
            let curves: Vec<Points> = curves
                .iter()
                .map(|points| points.iter().map(|p| p.map(f64::from)).collect())
                .map(|points: Points| if is_turned { turned(&points) } else { points })
                .collect();
            let filled = if are_parts { drawing(&curves, rule) } else { table(&curves) };
            let first = curves[0][0];
            let samples = Samples {
                size: [90, 90],
                spacing: 0.15713,
                origin: [first[0] - 7.012_345_1, first[1] - 6.987_123_7],
            };
            let inside = filled.covered(&filled.whole(), &samples).unwrap().inside;
            match resolved(&filled) {
                Resolved::Boundary(contour) => {
                    let numbers = winding_numbers(&contour, &samples).unwrap();
                    let expected: Vec<i32> = inside.into_iter().map(i32::from).collect();
                    prop_assert_eq!(numbers, expected);
                }
                Resolved::Apart => {}
                Resolved::Unknown => prop_assert!(false, "the boundary is unknown"),
            }
        }
    }
}
