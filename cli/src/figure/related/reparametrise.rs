//! The best reparametrisation of a curve, by dynamic programming.

use super::curve::Point;
use super::space::{scaled, size};

/// Most intervals of either curve between two corners of a reparametrisation.
const REACH: usize = 5;

/// Pairs of coprime numbers of intervals: the slopes.
fn slopes() -> Vec<[usize; 2]> {
    let coprime =
        |a: usize, b: usize| (2..=REACH).all(|d| !a.is_multiple_of(d) || !b.is_multiple_of(d));
    (1..=REACH)
        .flat_map(|a| (1..=REACH).map(move |b| [a, b]))
        .filter(|&[a, b]| coprime(a, b))
        .collect()
}

/// `(b o g) sqrt(g')` on interval `m` of a piece of slope `s` that starts at `j`.
fn value(b: &[Point], j: usize, m: usize, s: f64) -> Point {
    let at = (j as f64 + (m as f64 + 0.5) * s) as usize;
    let q = b[at.min(b.len() - 1)];
    [s.sqrt() * q[0], s.sqrt() * q[1]]
}

/// `(b o g) sqrt(g')`, of norm 1, for the increasing piecewise linear `g` of `[0, 1]` onto itself that
/// minimises `int |a - (b o g) sqrt(g')|^2`, among those whose corners are ends of intervals of both and
/// whose slopes are ratios of two of the numbers from 1 to 5.
///
/// # Panics
/// If the numbers of intervals differ.
pub(super) fn reparametrise(a: &[Point], b: &[Point]) -> Vec<Point> {
    let n = a.len();
    assert_eq!(b.len(), n, "curves of one number of intervals");
    let slopes = slopes();
    // The least cost of a g with g(i) = j, and the slope of its last piece.
    let mut least = vec![f64::INFINITY; (n + 1) * (n + 1)];
    let mut last = vec![0; (n + 1) * (n + 1)];
    least[0] = 0.0;
    for i in 1..=n {
        for j in 1..=n {
            let here = i * (n + 1) + j;
            for (number, &[di, dj]) in slopes.iter().enumerate() {
                if di > i || dj > j {
                    continue;
                }
                let (from, start) = ((i - di) * (n + 1) + j - dj, [i - di, j - dj]);
                if least[from] >= least[here] {
                    continue;
                }
                let s = dj as f64 / di as f64;
                let mut cost = least[from];
                for m in 0..di {
                    let (p, q) = (a[start[0] + m], value(b, start[1], m, s));
                    cost += (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
                }
                if cost < least[here] {
                    (least[here], last[here]) = (cost, number);
                }
            }
        }
    }
    let mut found = vec![[0.0; 2]; n];
    let (mut i, mut j) = (n, n);
    while i > 0 && j > 0 {
        let [di, dj] = slopes[last[i * (n + 1) + j]];
        (i, j) = (i - di, j - dj);
        let s = dj as f64 / di as f64;
        for m in 0..di {
            found[i + m] = value(b, j, m, s);
        }
    }
    let length = size(&found);
    if length > 0.0 {
        scaled(&found, length.recip())
    } else {
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn there_are_nineteen_slopes() {
        assert_eq!(slopes().len(), 19);
    }

    /// A step that comes early is moved to where it comes late: both pieces have slopes of the list.
    #[test]
    fn a_step_is_moved_to_its_place() {
        let n = 60;
        let step = |at: usize| -> Vec<Point> {
            // Of constant velocity before and after, and of length 1/2 each.
            let size = |k: usize| {
                if k < at {
                    0.5 / at as f64
                } else {
                    0.5 / (n - at) as f64
                }
            };
            let own = |k: usize| size(k).sqrt();
            (0..n)
                .map(|k| if k < at { [own(k), 0.0] } else { [0.0, own(k)] })
                .collect()
        };
        let (early, late) = (step(20), step(40));
        let moved = reparametrise(&late, &early);
        for (p, q) in moved.iter().zip(&late) {
            assert_relative_eq!(p[0], q[0], epsilon = 1e-12);
            assert_relative_eq!(p[1], q[1], epsilon = 1e-12);
        }
    }
}
