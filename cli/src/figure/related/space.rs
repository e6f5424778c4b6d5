//! Means and medians in spaces with geodesics.

use super::curve::{Point, norm, plus};

/// Most iterations of a mean or median.
const ITERATIONS: usize = 200;
/// Steps below this, in the metric of the space, end an iteration.
const SMALLEST: f64 = 1e-9;

/// A Riemannian manifold whose points and tangent vectors are lists of plane vectors, with the norm
/// `sqrt(sum |v_k|^2)` of tangent vectors.
pub(super) trait Space {
    /// The initial velocity of the shortest geodesic from `at` to `to` in unit time.
    fn log(&self, at: &[Point], to: &[Point]) -> Vec<Point>;

    /// The point that the geodesic from `at` with this velocity reaches in unit time.
    fn exp(&self, at: &[Point], velocity: &[Point]) -> Vec<Point>;
}

/// The orbits of a group that acts on the unit sphere by isometries, each given by one of its points.
pub(super) struct Orbits {
    /// The point nearest to the first argument in the orbit of the second.
    pub aligned: fn(&[Point], &[Point]) -> Vec<Point>,
}

impl Space for Orbits {
    fn log(&self, at: &[Point], to: &[Point]) -> Vec<Point> {
        sphere_log(at, &(self.aligned)(at, to))
    }

    fn exp(&self, at: &[Point], velocity: &[Point]) -> Vec<Point> {
        sphere_exp(at, velocity)
    }
}

/// The norm of a tangent vector.
pub(super) fn size(v: &[Point]) -> f64 {
    v.iter()
        .map(|v| v[0] * v[0] + v[1] * v[1])
        .sum::<f64>()
        .sqrt()
}

/// `v + t w`.
pub(super) fn added(v: &[Point], t: f64, w: &[Point]) -> Vec<Point> {
    v.iter().zip(w).map(|(v, w)| plus(*v, t, *w)).collect()
}

/// The Karcher mean by gradient descent of `(1/2n) sum d(m, x_i)^2` from a start:
/// `m <- Exp_m((1/n) sum Log_m x_i)`.
pub(super) fn karcher_mean(
    space: &dyn Space,
    points: &[Vec<Point>],
    start: &[Point],
    iterations: usize,
) -> Vec<Point> {
    let mut mean = start.to_vec();
    for _ in 0..iterations {
        let mut step = vec![[0.0; 2]; mean.len()];
        for point in points {
            step = added(&step, 1.0 / points.len() as f64, &space.log(&mean, point));
        }
        mean = space.exp(&mean, &step);
        if size(&step) < SMALLEST {
            break;
        }
    }
    mean
}

/// The geometric median `argmin_m sum d(m, x_i)` by the iteration of Weiszfeld:
///
/// ```text
/// m <- Exp_m(G),  G = (sum_i Log_m(x_i) / d_i) / (sum_i 1 / d_i),  d_i = d(m, x_i),
/// ```
///
/// the sums over all points at a positive distance from `m`.
///
/// Source: P. T. Fletcher, S. Venkatasubramanian, S. Joshi: The geometric median on Riemannian manifolds
/// with application to robust atlas estimation. NeuroImage 45 (2009), equation 8, of step length 1.
pub(super) fn geometric_median(
    space: &dyn Space,
    points: &[Vec<Point>],
    start: &[Point],
) -> Vec<Point> {
    let mut median = start.to_vec();
    for _ in 0..ITERATIONS {
        let mut step = vec![[0.0; 2]; median.len()];
        let mut total = 0.0;
        for point in points {
            let log = space.log(&median, point);
            let distance = size(&log);
            if distance > SMALLEST {
                step = added(&step, 1.0 / distance, &log);
                total += 1.0 / distance;
            }
        }
        if total == 0.0 {
            break;
        }
        for v in &mut step {
            *v = [v[0] / total, v[1] / total];
        }
        median = space.exp(&median, &step);
        if size(&step) < SMALLEST {
            break;
        }
    }
    median
}

/// Exponential map of the unit sphere.
fn sphere_exp(at: &[Point], velocity: &[Point]) -> Vec<Point> {
    let angle = size(velocity);
    if angle == 0.0 {
        return at.to_vec();
    }
    let sum = added(&scaled(at, angle.cos()), angle.sin() / angle, velocity);
    // Rounding errors do not accumulate over iterations.
    scaled(&sum, size(&sum).recip())
}

/// Logarithm of the unit sphere; zero for antipodes, which have no shortest geodesic.
pub(super) fn sphere_log(at: &[Point], to: &[Point]) -> Vec<Point> {
    let cos = dot(at, to);
    let across = added(to, -cos, at);
    let sin = size(&across);
    if sin == 0.0 {
        return vec![[0.0; 2]; at.len()];
    }
    scaled(&across, sin.atan2(cos) / sin)
}

pub(super) fn dot(v: &[Point], w: &[Point]) -> f64 {
    v.iter()
        .zip(w)
        .map(|(v, w)| v[0] * w[0] + v[1] * w[1])
        .sum()
}

pub(super) fn scaled(v: &[Point], t: f64) -> Vec<Point> {
    v.iter().map(|v| [t * v[0], t * v[1]]).collect()
}

/// `v` turned by the angle of the complex number `by`, which need not have modulus 1.
pub(super) fn turned(v: &[Point], by: Point) -> Vec<Point> {
    let modulus = norm(by);
    if modulus == 0.0 {
        return v.to_vec();
    }
    let [cos, sin] = [by[0] / modulus, by[1] / modulus];
    let turn = |v: &Point| [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1]];
    v.iter().map(turn).collect()
}

/// The Hermitian product `sum conj(v_k) w_k` of vectors of complex numbers.
pub(super) fn hermitian(v: &[Point], w: &[Point]) -> Point {
    let pairs = v.iter().zip(w);
    pairs.fold([0.0; 2], |sum, (v, w)| {
        [
            sum[0] + v[0] * w[0] + v[1] * w[1],
            sum[1] + v[0] * w[1] - v[1] * w[0],
        ]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    struct Plane;

    impl Space for Plane {
        fn log(&self, at: &[Point], to: &[Point]) -> Vec<Point> {
            added(to, -1.0, at)
        }

        fn exp(&self, at: &[Point], velocity: &[Point]) -> Vec<Point> {
            added(at, 1.0, velocity)
        }
    }

    /// The sphere itself.
    const SPHERE: Orbits = Orbits {
        aligned: |_, to| to.to_vec(),
    };

    /// On a line the geometric median is the median of the numbers, and the mean their mean.
    #[test]
    fn the_median_of_points_on_a_line_is_the_middle_one() {
        let at = |t: f64| vec![[3.0 * t, 4.0 * t]];
        let points = [0.0, 0.1, 0.2, 1.0, 7.0].map(at).to_vec();
        let mean = karcher_mean(&Plane, &points, &points[4], 5);
        assert_relative_eq!(mean[0][0], 3.0 * 1.66, epsilon = 1e-12);
        let median = geometric_median(&Plane, &points, &mean);
        assert_relative_eq!(median[0][0], 0.6, epsilon = 1e-6);
        assert_relative_eq!(median[0][1], 0.8, epsilon = 1e-6);
    }

    /// The Fermat point of a triangle sees its sides under 120 degrees.
    #[test]
    fn the_median_of_a_triangle_is_its_fermat_point() {
        let points = [[0.0, 0.0], [1.0, 0.0], [0.2, 0.9]]
            .map(|p| vec![p])
            .to_vec();
        let median = geometric_median(&Plane, &points, &[[0.4, 0.3]]);
        let units: Vec<Point> = points
            .iter()
            .map(|p| scaled(&added(p, -1.0, &median), 1.0))
            .map(|v| [v[0][0] / size(&v), v[0][1] / size(&v)])
            .collect();
        for k in 0..3 {
            let (a, b) = (units[k], units[(k + 1) % 3]);
            assert_relative_eq!(a[0] * b[0] + a[1] * b[1], -0.5, epsilon = 1e-6);
        }
    }

    #[test]
    fn the_mean_on_a_sphere_is_the_middle_of_a_great_circle() {
        let at = |t: f64| vec![[t.cos(), t.sin()], [0.0, 0.0]];
        let mean = karcher_mean(&SPHERE, &[at(0.0), at(0.8)], &at(0.0), 50);
        assert_relative_eq!(mean[0][1], 0.4f64.sin(), epsilon = 1e-12);
        assert_relative_eq!(size(&sphere_log(&at(0.2), &at(1.0))), 0.8, epsilon = 1e-12);
    }
}
