//! The point of a segment or triangle that is nearest to a given point.

use crate::vector::{add_scaled, dot, sub};

/// The nearest point of a simplex: its squared distance, and its barycentric weights, which
/// are exactly zero at the corners that do not take part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closest<const D: usize> {
    pub(crate) distance_squared: f64,
    pub(crate) weights: [f64; D],
}

/// The nearest point of the segment (`D = 2`) or triangle (`D = 3`) with the given corners.
///
/// The point is always a convex combination of the corners, so that even a degenerate simplex
/// never reports less than its true distance.
#[inline]
pub(crate) fn closest<const D: usize>(corners: &[[f64; D]; D], p: &[f64; D]) -> Closest<D> {
    let weights = if D == 2 {
        segment_weights(corners, p)
    } else {
        triangle_weights(corners, p)
    };
    let mut offset = sub(p, &corners[0]);
    for k in 1..D {
        offset = add_scaled(&offset, -weights[k], &sub(&corners[k], &corners[0]));
    }
    Closest {
        distance_squared: dot(&offset, &offset),
        weights,
    }
}

#[inline]
fn segment_weights<const D: usize>(corners: &[[f64; D]; D], p: &[f64; D]) -> [f64; D] {
    let edge = sub(&corners[1], &corners[0]);
    let along = dot(&edge, &sub(p, &corners[0]));
    let s = ratio(along, dot(&edge, &edge)).clamp(0.0, 1.0);
    two_weights(0, 1, s)
}

/// The region tests of Ericson, *Real-Time Collision Detection* (2005), section 5.1.5.
#[inline]
fn triangle_weights<const D: usize>(corners: &[[f64; D]; D], p: &[f64; D]) -> [f64; D] {
    let ab = sub(&corners[1], &corners[0]);
    let ac = sub(&corners[2], &corners[0]);
    let ap = sub(p, &corners[0]);
    let (d1, d2) = (dot(&ab, &ap), dot(&ac, &ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return two_weights(0, 1, 0.0);
    }
    let bp = sub(p, &corners[1]);
    let (d3, d4) = (dot(&ab, &bp), dot(&ac, &bp));
    if d3 >= 0.0 && d4 <= d3 {
        return two_weights(0, 1, 1.0);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        return two_weights(0, 1, ratio(d1, d1 - d3));
    }
    let cp = sub(p, &corners[2]);
    let (d5, d6) = (dot(&ab, &cp), dot(&ac, &cp));
    if d6 >= 0.0 && d5 <= d6 {
        return two_weights(0, 2, 1.0);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6 {
        return two_weights(0, 2, ratio(d2, d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return two_weights(1, 2, ratio(d4 - d3, (d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    let mut weights = [0.0; D];
    weights[1] = ratio(vb, sum).clamp(0.0, 1.0);
    weights[2] = ratio(vc, sum).clamp(0.0, 1.0 - weights[1]);
    weights[0] = 1.0 - weights[1] - weights[2];
    weights
}

/// Weight `1 - s` at corner `i` and `s` at corner `j`.
#[inline]
fn two_weights<const D: usize>(i: usize, j: usize, s: f64) -> [f64; D] {
    let mut weights = [0.0; D];
    weights[i] = 1.0 - s;
    weights[j] = s;
    weights
}

/// `a / b`, zero where `b` is not positive: a degenerate edge is its first corner.
#[inline]
fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 0.0 }
}
