//! A 2D contour as curves.

use std::collections::HashMap;
use std::fmt::Write;

use crate::contour::Contour;

/// A curve through points, with the object to its left.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    /// The points in order; the first is not repeated at the end of a closed curve.
    pub points: Vec<[f64; 2]>,
    /// Whether the last point is joined to the first.
    pub closed: bool,
}

impl Contour<2> {
    /// Joins the segments to curves: every segment belongs to exactly one curve. Open curves, which
    /// start and end at the edge of the box, come first.
    pub fn polylines(&self) -> Vec<Polyline> {
        let mut leaving: HashMap<u32, Vec<usize>> = HashMap::new();
        let mut balance: HashMap<u32, i64> = HashMap::new();
        for (i, &[from, to]) in self.simplices().iter().enumerate().rev() {
            leaving.entry(from).or_default().push(i);
            *balance.entry(from).or_default() += 1;
            *balance.entry(to).or_default() -= 1;
        }
        let mut curves = Vec::new();
        let starts = |open: bool| {
            let balance = &balance;
            let list = self.simplices().iter().map(|s| s[0]);
            list.filter(move |p| !open || balance[p] > 0)
        };
        for start in starts(true).chain(starts(false)) {
            if let Some(curve) = self.follow(start, &mut leaving) {
                curves.push(curve);
            }
        }
        curves
    }

    /// Follows the curve from a point until it returns to it or ends.
    fn follow(&self, start: u32, leaving: &mut HashMap<u32, Vec<usize>>) -> Option<Polyline> {
        let mut points = Vec::new();
        let mut here = start;
        while let Some(segment) = leaving.get_mut(&here).and_then(Vec::pop) {
            points.push(self.points()[here as usize]);
            here = self.simplices()[segment][1];
            if here == start {
                break;
            }
        }
        let closed = here == start;
        if points.is_empty() {
            return None;
        }
        if !closed {
            points.push(self.points()[here as usize]);
        }
        Some(Polyline { points, closed })
    }
}

/// The path data of curves for an SVG drawing, closed where they are, with this number of decimals, at most 17. `y`
/// points upwards in the plane and downwards in drawings: scale by `(1, -1)`.
///
/// ```
/// use levelset::{Polyline, svg_path};
/// let triangle = Polyline { points: vec![[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]], closed: true };
/// assert_eq!(svg_path([(triangle.points.as_slice(), triangle.closed)], 1), "M0.0 0.0L1.0 0.0L0.5 1.0Z");
/// ```
pub fn svg_path<'a>(
    curves: impl IntoIterator<Item = (&'a [[f64; 2]], bool)>,
    decimals: usize,
) -> String {
    // More say nothing of a number, and formats do not take all of them.
    let decimals = decimals.min(17);
    let mut path = String::new();
    for (points, closed) in curves {
        for (i, [x, y]) in points.iter().enumerate() {
            let command = if i == 0 { 'M' } else { 'L' };
            // Writing to a string does not fail.
            let _ = write!(path, "{command}{x:.decimals$} {y:.decimals$}");
        }
        if closed {
            path.push('Z');
        }
    }
    path
}

impl Contour<2> {
    /// The path data of the contour for an SVG drawing; see [`svg_path`].
    pub fn svg_path(&self, decimals: usize) -> String {
        let curves = self.polylines();
        svg_path(
            curves.iter().map(|c| (c.points.as_slice(), c.closed)),
            decimals,
        )
    }
}
