//! Elastic curves: square-root velocity functions, their distances and their mean.
//!
//! Source: A. Srivastava, E. Klassen, S. H. Joshi, I. H. Jermyn: Shape analysis of elastic curves in
//! Euclidean spaces. IEEE Trans. PAMI 33 (2011). A curve `c` of length 1 is represented by
//! `q = c' / sqrt |c'|`, which has norm 1 in `L2`: curves are points of a sphere, on which the elastic metric
//! is that of the sphere. Rotations, starting points and reparametrisations `q -> (q o g) sqrt(g')` are
//! isometries; the distance of shapes is the least over them, `arccos <q_1, O (q_2 o g) sqrt(g')>`.
//!
//! Approximations: `q` is constant on `SAMPLES` intervals; reparametrisations are found by dynamic
//! programming among piecewise linear ones with slopes from a finite list (`reparametrise`), for the
//! starting points that fit best without; and the geodesics are those of the whole sphere, in which
//! curves between closed ones need not be closed. The gap of a mean is distributed over the curve.

use super::curve::{Curve, Point, minus, norm, plus};
use super::landmarks::centroid;
use super::reparametrise::reparametrise;
use super::space::{Orbits, dot, hermitian, karcher_mean, scaled, size, sphere_log, turned};

/// Intervals of a curve.
pub(super) const SAMPLES: usize = 96;
/// Starting points that are tried with reparametrisations.
const CANDIDATES: usize = 3;
/// Rounds of rotation and reparametrisation.
const ROUNDS: usize = 2;
/// Iterations of the mean.
const ITERATIONS: usize = 12;

/// The square-root velocity function of a closed curve on equal intervals of its length, of norm 1 in
/// the product `sum q_k p_k` (weights `1/n` are in the values).
pub(super) fn of_closed(curve: &Curve) -> Vec<Point> {
    let points = curve.resampled(SAMPLES).points;
    let mut all = points;
    all.push(all[0]);
    of_open(&all)
}

/// The same of an open curve through these points, of which equal numbers of intervals take equal time.
pub(super) fn of_open(points: &[Point]) -> Vec<Point> {
    let q: Vec<Point> = points
        .windows(2)
        .map(|pair| {
            let velocity = minus(pair[1], pair[0]);
            let speed = norm(velocity);
            if speed > 0.0 {
                plus([0.0; 2], speed.sqrt().recip(), velocity)
            } else {
                [0.0; 2]
            }
        })
        .collect();
    let length = size(&q);
    if length > 0.0 {
        scaled(&q, length.recip())
    } else {
        q
    }
}

/// The curve of such a function, closed by distributing its gap, of this length, about the origin.
pub(super) fn curve_of(q: &[Point], length: f64) -> Curve {
    let n = q.len() as f64;
    // The velocity is q |q|.
    let steps: Vec<Point> = q
        .iter()
        .map(|q| [q[0] * norm(*q), q[1] * norm(*q)])
        .collect();
    let gap = steps.iter().fold([0.0; 2], |sum, v| plus(sum, 1.0, *v));
    let mut points = vec![[0.0; 2]];
    for step in &steps[..steps.len().saturating_sub(1)] {
        let last = points[points.len() - 1];
        points.push(plus(plus(last, 1.0, *step), -1.0 / n, gap));
    }
    let centre = centroid(&points);
    let curve = Curve { points };
    let scale = length / curve.length();
    let points = curve.points.iter().map(|p| minus(*p, centre));
    Curve {
        points: points.map(|p| [scale * p[0], scale * p[1]]).collect(),
    }
}

/// The distance of the shapes of closed curves.
pub(super) fn distance(a: &[Point], b: &[Point]) -> f64 {
    angle(a, &aligned(a, b))
}

fn angle(a: &[Point], b: &[Point]) -> f64 {
    size(&sphere_log(a, b))
}

/// `b` from the starting point, by the rotation and in the parametrisation for which it is nearest to `a`.
fn aligned(a: &[Point], b: &[Point]) -> Vec<Point> {
    let shifted = |shift: usize| [&b[shift..], &b[..shift]].concat();
    let fit = |shift: usize| {
        let [re, im] = hermitian(&shifted(shift), a);
        re.hypot(im)
    };
    let n = b.len();
    let fits: Vec<f64> = (0..n).map(fit).collect();
    // Neighbours of a good starting point are nearly as good: only local maxima are candidates.
    let mut maxima: Vec<usize> = (0..n)
        .filter(|&k| fits[k] >= fits[(k + 1) % n] && fits[k] >= fits[(k + n - 1) % n])
        .collect();
    maxima.sort_by(|&i, &j| fits[j].total_cmp(&fits[i]));
    let mut best: Option<(f64, Vec<Point>)> = None;
    for &shift in maxima.iter().take(CANDIDATES) {
        let mut own = shifted(shift);
        for _ in 0..ROUNDS {
            own = turned(&own, hermitian(&own, a));
            own = reparametrise(a, &own);
        }
        own = turned(&own, hermitian(&own, a));
        let value = dot(a, &own);
        if best.as_ref().is_none_or(|(least, _)| value > *least) {
            best = Some((value, own));
        }
    }
    best.map_or_else(|| b.to_vec(), |(_, own)| own)
}

/// The shapes of closed curves.
const SHAPES: Orbits = Orbits { aligned };

/// The Karcher mean of closed curves, from the first.
pub(super) fn mean(curves: &[Vec<Point>]) -> Vec<Point> {
    karcher_mean(&SHAPES, curves, &curves[0], ITERATIONS)
}

#[cfg(test)]
mod tests {
    use super::super::curve::tests::circle;
    use super::*;
    use approx::assert_relative_eq;

    /// The distance of open curves in fixed positions.
    fn open_distance(a: &[Point], b: &[Point]) -> f64 {
        angle(a, &reparametrise(a, b))
    }

    /// Points of a segment under an angle, at the times `t^power`.
    fn segment(angle: f64, power: f64) -> Vec<Point> {
        let at = |k: usize| (k as f64 / SAMPLES as f64).powf(power);
        let point = |k| [at(k) * angle.cos(), at(k) * angle.sin()];
        of_open(&(0..=SAMPLES).map(point).collect::<Vec<_>>())
    }

    /// A segment has a constant `q`: two of them are at the angle between them, however fast they are
    /// passed.
    #[test]
    fn segments_are_at_their_angle() {
        for angle in [0.0, 0.3, 1.2] {
            let distance = open_distance(&segment(0.5, 1.0), &segment(0.5 + angle, 1.0));
            assert_relative_eq!(distance, angle, epsilon = 1e-9);
            // Of slopes from a list, and constant on intervals.
            let faster = open_distance(&segment(0.5, 1.0), &segment(0.5 + angle, 1.4));
            assert!((faster - angle).abs() < 0.06, "{faster} {angle}");
        }
        // Without reparametrisation the speeds alone separate them.
        assert!(angle(&segment(0.5, 1.0), &segment(0.5, 1.4)) > 0.12);
    }

    /// An ellipse is an ellipse, wherever it lies, whatever its size, and from wherever it is drawn.
    #[test]
    fn similar_curves_have_distance_zero() {
        let ellipse = |turn: f64, scale: f64, first: f64| {
            let (sin, cos) = turn.sin_cos();
            let mut curve = circle([0.0; 2], scale, 960);
            for p in &mut curve.points {
                let [x, y] = [2.0 * p[0], p[1]];
                *p = [cos * x - sin * y, sin * x + cos * y];
            }
            curve.points.rotate_left((960.0 * first) as usize);
            of_closed(&curve)
        };
        let a = ellipse(0.0, 0.1, 0.0);
        assert!(distance(&a, &ellipse(0.9, 0.2, 0.0)) < 1e-9);
        // A starting point between samples.
        assert!(distance(&a, &ellipse(0.9, 0.2, 0.3)) < 0.03);
        let round = of_closed(&circle([0.5; 2], 0.2, 960));
        assert!(distance(&a, &round) > 0.2);
        assert!(distance(&round, &round) < 1e-9);
    }

    /// The mean of two curves is the middle of the geodesic, and as long as asked for.
    #[test]
    fn the_mean_of_two_is_in_the_middle() {
        let mut flat = circle([0.0; 2], 0.1, 960);
        for p in &mut flat.points {
            p[1] *= 0.5;
        }
        let [a, b] = [&circle([0.0; 2], 0.1, 960), &flat].map(of_closed);
        let mean = mean(&[a.clone(), b.clone()]);
        let (to_a, to_b, whole) = (distance(&mean, &a), distance(&mean, &b), distance(&a, &b));
        assert_relative_eq!(to_a, to_b, max_relative = 0.05);
        assert_relative_eq!(to_a + to_b, whole, max_relative = 0.05);
        let curve = curve_of(&mean, 2.0);
        assert_relative_eq!(curve.length(), 2.0, max_relative = 1e-12);
    }
}
