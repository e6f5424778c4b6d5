//! The point of a segment or triangle that is nearest to given points, one in each entry of a
//! lane.

use fe_grid::Lane;

use crate::vector::{add_scaled, dot, sub};

/// The nearest point of a simplex: its squared distance, and its barycentric weights, which are
/// exactly zero at the corners of which it is independent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closest<L, const D: usize> {
    pub(crate) distance_squared: L,
    pub(crate) weights: [L; D],
}

/// A segment (`D = 2`) or triangle (`D = 3`) with all quantities that do not depend on the point.
///
/// The nearest point is computed on every side and inside, without branches, so that all entries of
/// a lane execute the same operations. Each candidate is a convex combination of the corners, so
/// even a degenerate simplex never reports less than its true distance; and the sides of a sliver,
/// whose interior is dominated by rounding errors, are accurate.
#[derive(Clone, Debug)]
pub(crate) struct Simplex<const D: usize> {
    origin: [f64; D],
    /// From the first corner to the others; the second is zero for a segment.
    edges: [[f64; D]; 2],
    /// Inverse squared lengths of the edges, then of the side between their ends; zero if not
    /// finite.
    inverse_squares: [f64; 3],
    /// `(edge 1 - edge 0) . edge 0`.
    skew: f64,
    /// The basis dual to the edges, in their plane: its products with a ray are the weights of
    /// the ray's foot. Zero for a triangle without area.
    dual: [[f64; D]; 2],
}

impl<const D: usize> Simplex<D> {
    pub(crate) fn new(corners: &[[f64; D]; D]) -> Self {
        let origin = corners[0];
        let mut edges = [[0.0; D]; 2];
        for (edge, corner) in edges.iter_mut().zip(&corners[1..]) {
            *edge = sub(corner, &origin);
        }
        let [first, second] = edges;
        let side = sub(&second, &first);
        Self {
            origin,
            edges,
            inverse_squares: [&first, &second, &side].map(|e| inverse(dot(e, e))),
            skew: dot(&side, &first),
            dual: dual(&first, &second),
        }
    }

    /// Computes the nearest point.
    #[inline(always)]
    pub(crate) fn closest<L: Lane<Element = f64>>(&self, p: &[L; D]) -> Closest<L, D> {
        let (zero, one) = (L::zero(), L::one());
        let clamp = |s: L| s.max(zero).min(one);
        let mut ray = *p;
        let (mut along_first, mut along_second) = (zero, zero);
        for k in 0..D {
            ray[k] -= L::splat(self.origin[k]);
            along_first = L::splat(self.edges[0][k]).mul_add(ray[k], along_first);
            along_second = L::splat(self.edges[1][k]).mul_add(ray[k], along_second);
        }
        let s = clamp(along_first.scale(self.inverse_squares[0]));
        let mut weights = [zero; D];
        (weights[0], weights[1]) = (one - s, s);
        let mut found = Closest {
            distance_squared: self.distance_squared(&ray, s, zero),
            weights,
        };
        if D == 2 {
            return found;
        }
        let s = clamp(along_second.scale(self.inverse_squares[1]));
        found.improve(self.distance_squared(&ray, zero, s), [one - s, zero, s]);
        let along_side = along_second - along_first - L::splat(self.skew);
        let s = clamp(along_side.scale(self.inverse_squares[2]));
        let r = one - s;
        found.improve(self.distance_squared(&ray, r, s), [zero, r, s]);
        let (mut v, mut w) = (zero, zero);
        for k in 0..D {
            v = L::splat(self.dual[0][k]).mul_add(ray[k], v);
            w = L::splat(self.dual[1][k]).mul_add(ray[k], w);
        }
        let u = one - v - w;
        let inside = zero.less(u.min(v.min(w)));
        let foot = self.distance_squared(&ray, v, w);
        let foot = L::select(inside, foot, L::splat(f64::INFINITY));
        found.improve(foot, [u, v, w]);
        found
    }

    /// Squared distance of the end of a ray from the point with these weights of the edges.
    #[inline(always)]
    fn distance_squared<L: Lane<Element = f64>>(&self, ray: &[L; D], v: L, w: L) -> L {
        let mut sum = L::zero();
        for k in 0..D {
            let mut offset = (-v).mul_add(L::splat(self.edges[0][k]), ray[k]);
            if D == 3 {
                offset = (-w).mul_add(L::splat(self.edges[1][k]), offset);
            }
            sum = offset.mul_add(offset, sum);
        }
        sum
    }
}

impl<L: Lane<Element = f64>, const D: usize> Closest<L, D> {
    /// Replaces the candidate by another one if that is nearer.
    #[inline(always)]
    fn improve(&mut self, distance_squared: L, weights: [L; 3]) {
        let nearer = distance_squared.less(self.distance_squared);
        self.distance_squared = L::select(nearer, distance_squared, self.distance_squared);
        for (old, new) in self.weights.iter_mut().zip(weights) {
            *old = L::select(nearer, new, *old);
        }
    }
}

/// Vectors `a`, `b` of the plane of `first` and `second` with `a . first = b . second = 1` and
/// `a . second = b . first = 0`; zero where the two are parallel.
fn dual<const D: usize>(first: &[f64; D], second: &[f64; D]) -> [[f64; D]; 2] {
    let scale = inverse(dot(first, first));
    // The second pass removes the rounding error in the direction of `first`, which matters in
    // slivers.
    let mut across = *second;
    for _ in 0..2 {
        across = add_scaled(&across, -scale * dot(&across, first), first);
    }
    let b = across.map(|x| x * inverse(dot(&across, &across)));
    let a = add_scaled(&[0.0; D], scale, first);
    let a = add_scaled(&a, -scale * dot(first, second), &b);
    if a.iter().chain(&b).all(|x| x.is_finite()) {
        [a, b]
    } else {
        [[0.0; D]; 2]
    }
}

/// Returns `1 / x`, or zero if that is not finite.
fn inverse(x: f64) -> f64 {
    let inverse = 1.0 / x;
    if inverse.is_finite() { inverse } else { 0.0 }
}
