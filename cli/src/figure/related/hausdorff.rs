//! The mean for a smooth approximation of the Hausdorff distance of curves.
//!
//! Source: G. Charpiat, O. Faugeras, R. Keriven: Approximations of shape metrics and application to
//! shape warping and empirical shape statistics. Found. Comput. Math. 5 (2005). There maxima are replaced
//! by means of powers (section 3.2), and the empirical mean minimises `(1/N) sum E(C, C_i)^2` by gradient
//! descent (section 5.1). Here:
//!
//! ```text
//! E(C, C')^b = 1/2 (1/|C|) int_C d_C'^b + 1/2 (1/|C'|) int_C' d_C^b,
//! ```
//!
//! which tends to the Hausdorff distance for large `b`. The distances `d` themselves are exact, where the
//! source has a further mean in place of their minimum. The descent moves the points of a polygon along the
//! gradient, smoothed along the curve: the topology is that of the curve it starts from. The source adds a
//! term of the perimeter; here the smoothing alone keeps the curve from waves.

use super::curve::{Curve, Point, minus, plus};
use super::space::dot;

/// The exponent `b`. Larger ones come closer to the maximum, and their gradients see fewer points.
const POWER: i32 = 4;
/// Points of a curve.
const POINTS: usize = 160;
/// Most steps of a stage of the descent.
const STEPS: usize = 150;
/// Most passes of the mean `(1, 2, 1) / 4` over the gradient, those of the first stage: the curve then moves
/// nearly as a whole. The mean has a positive symbol, so that the smoothed negative gradient is a direction of
/// descent. (The source has inner products of smooth fields for the same purpose.)
const MOST_PASSES: usize = 400;
/// Fewest passes, over about the neighbours of a point.
const LEAST_PASSES: usize = 4;
/// The share of the decrease by the slope that a step has to reach.
const ARMIJO: f64 = 0.25;
/// Smallest relative decrease of a step.
const SMALLEST: f64 = 1e-6;

/// The approximation `E` of the Hausdorff distance.
pub(super) fn distance(a: &Curve, b: &Curve) -> f64 {
    let [a, b] = [a, b].map(|curve| curve.resampled(POINTS));
    energy(&a, &b).powf(f64::from(POWER).recip())
}

/// `E^b` of curves whose points are at equal distances.
fn energy(a: &Curve, b: &Curve) -> f64 {
    let side = |from: &Curve, to: &Curve| {
        let powers = from
            .points
            .iter()
            .map(|p| to.nearest(*p).distance.powi(POWER));
        powers.sum::<f64>() / from.points.len() as f64
    };
    0.5 * (side(a, b) + side(b, a))
}

/// `(1/N) sum E^2`.
fn mean_square(curve: &Curve, shapes: &[Curve]) -> f64 {
    let share = 2.0 / f64::from(POWER);
    let squares = shapes.iter().map(|shape| energy(curve, shape).powf(share));
    squares.sum::<f64>() / shapes.len() as f64
}

/// The derivatives of [`mean_square`] with respect to the points, the weights of the points being those
/// of points at equal distances; relative to these weights.
fn gradient(curve: &Curve, shapes: &[Curve]) -> Vec<Point> {
    let n = curve.points.len();
    let mut gradient = vec![[0.0; 2]; n];
    for shape in shapes {
        let value = energy(curve, shape);
        if value == 0.0 {
            // At the shape itself the square of the distance is least.
            continue;
        }
        // d (E^b)^(2/b) = (2/b) (E^b)^(2/b - 1) d E^b, and d |x - y|^b = b |x - y|^(b - 2) (x - y).
        let factor = value.powf(2.0 / f64::from(POWER) - 1.0) / shapes.len() as f64;
        for (own, p) in gradient.iter_mut().zip(&curve.points) {
            let foot = shape.nearest(*p);
            let weight = factor * foot.distance.powi(POWER - 2);
            *own = plus(*own, weight, minus(*p, foot.point));
        }
        let ratio = n as f64 / shape.points.len() as f64;
        for x in &shape.points {
            let foot = curve.nearest(*x);
            let weight = factor * ratio * foot.distance.powi(POWER - 2);
            let away = minus(foot.point, *x);
            let (here, next) = (foot.segment, (foot.segment + 1) % n);
            gradient[here] = plus(gradient[here], (1.0 - foot.share) * weight, away);
            gradient[next] = plus(gradient[next], foot.share * weight, away);
        }
    }
    gradient
}

fn smoothed(mut field: Vec<Point>, passes: usize) -> Vec<Point> {
    let n = field.len();
    for _ in 0..passes {
        let mean = |k: usize, c: usize| {
            0.25 * (field[(k + n - 1) % n][c] + 2.0 * field[k][c] + field[(k + 1) % n][c])
        };
        field = (0..n).map(|k| [mean(k, 0), mean(k, 1)]).collect();
    }
    field
}

/// The empirical mean: the local minimum of `(1/N) sum E(C, C_i)^2` that gradient descent reaches from
/// the curve with the least sum.
pub(super) fn mean(curves: &[Curve]) -> Curve {
    let shapes: Vec<Curve> = curves.iter().map(|curve| curve.resampled(POINTS)).collect();
    let start = shapes
        .iter()
        .map(|shape| (mean_square(shape, &shapes), shape));
    let start = start.fold(
        (f64::INFINITY, &shapes[0]),
        |a, b| if b.0 < a.0 { b } else { a },
    );
    // Waves that are short beside the distance of the shapes come close to all of them, and the curve does
    // not move far from any: the sum favours them over every smooth curve. The last stage leaves them out.
    let spread = start.0.sqrt() * POINTS as f64 / start.1.length();
    let last = (2.0 * spread * spread) as usize;
    let smooth = descended(start.1.clone(), &shapes, MOST_PASSES);
    descended(smooth, &shapes, last.clamp(LEAST_PASSES, MOST_PASSES))
}

/// Gradient descent with gradients that are smoothed by this number of passes.
fn descended(mut curve: Curve, shapes: &[Curve], passes: usize) -> Curve {
    let mut value = mean_square(&curve, shapes);
    let mut step = 1.0;
    for _ in 0..STEPS {
        let gradient = gradient(&curve, shapes);
        let direction = smoothed(gradient.clone(), passes);
        let slope = dot(&gradient, &direction) / gradient.len() as f64;
        let moved = |step: f64| {
            let pairs = curve.points.iter().zip(&direction);
            let points = pairs.map(|(p, g)| plus(*p, -step, *g)).collect();
            Curve { points }.resampled(POINTS)
        };
        let found = std::iter::successors(Some(step), |step| Some(0.5 * step))
            .take(16)
            .map(|step| (step, moved(step)))
            .map(|(step, curve)| (step, mean_square(&curve, shapes), curve))
            .find(|(step, next, _)| *next < value - ARMIJO * step * slope);
        let Some((taken, next, moved)) = found else {
            break;
        };
        let decrease = value - next;
        (value, curve, step) = (next, moved, 2.0 * taken);
        if decrease < SMALLEST * value {
            break;
        }
    }
    curve
}

#[cfg(test)]
mod tests {
    use super::super::curve::tests::circle;
    use super::*;
    use approx::assert_relative_eq;

    /// Concentric circles are at the distance of their radii for every power.
    #[test]
    fn circles_are_as_far_apart_as_their_radii() {
        let [a, b] = [0.2, 0.3].map(|r| circle([0.5; 2], r, 400));
        assert_relative_eq!(distance(&a, &b), 0.1, max_relative = 2e-3);
        assert!(distance(&a, &a) < 1e-12);
    }

    /// The circle of the mean radius minimises the sum of the squares of `|R - r_i|`.
    #[test]
    fn the_mean_of_concentric_circles_has_the_mean_radius() {
        for radii in [vec![0.16, 0.2, 0.33], vec![0.2, 0.3]] {
            let circles: Vec<Curve> = radii.iter().map(|r| circle([0.5; 2], *r, 400)).collect();
            let expected = radii.iter().sum::<f64>() / radii.len() as f64;
            for p in &mean(&circles).points {
                let radius = (p[0] - 0.5).hypot(p[1] - 0.5);
                assert_relative_eq!(radius, expected, max_relative = 1e-2);
            }
        }
    }

    /// Against differences, in the direction of a motion that keeps the points at equal distances.
    #[test]
    fn the_gradient_is_a_derivative() {
        let shapes = [
            circle([0.5, 0.5], 0.2, POINTS),
            circle([0.55, 0.48], 0.3, POINTS),
        ];
        let curve = circle([0.47, 0.5], 0.22, POINTS);
        let gradient = gradient(&curve, &shapes);
        for direction in [[1.0, 0.0], [0.0, 1.0]] {
            let derivative = gradient
                .iter()
                .map(|g| g[0] * direction[0] + g[1] * direction[1])
                .sum::<f64>()
                / POINTS as f64;
            let at = |t: f64| {
                let points = curve.points.iter().map(|p| plus(*p, t, direction));
                mean_square(
                    &Curve {
                        points: points.collect(),
                    },
                    &shapes,
                )
            };
            let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
            // The distance from a polygon has kinks on the bisectors of its corners, .04 rad each.
            assert_relative_eq!(derivative, difference, max_relative = 2e-3, epsilon = 1e-9);
        }
    }
}
