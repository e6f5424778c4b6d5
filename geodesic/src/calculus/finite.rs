//! The calculus in finite dimensions, where exponential maps and transports are known exactly.

use super::space::PathSpace;
use crate::error::GeodesicError;
use crate::finite::{Dissimilarity, StereographicSphere};
use nalgebra::{SMatrix, SVector, Vector2, Vector3};

/// Maximal number of Newton steps.
const MOST_STEPS: usize = 50;
/// Maximal number of halvings of a step.
const MOST_HALVINGS: i32 = 10;
/// A step below this length, relative to the points, is due to rounding.
const ROUNDING: f64 = 1e-15;
/// Step of the finite differences of gradients, relative to the size of the points.
const DIFFERENCE: f64 = 1e-5;
/// Tolerance of the residual, as a fraction of the forces that balance in it.
const BALANCED: f64 = 1e-6;

/// Points of `R^N` with a dissimilarity as the energy of a step. Both equations are solved by
/// Newton's method with a finite-difference Jacobian.
#[derive(Clone, Copy, Debug)]
pub struct FiniteSpace<'a, W, const N: usize> {
    /// The energy `W(a, b)` of a step.
    pub dissimilarity: &'a W,
}

impl<W: Dissimilarity<N>, const N: usize> PathSpace for FiniteSpace<'_, W, N> {
    type Point = [f64; N];
    type Error = GeodesicError;

    fn extended(&mut self, a: &[f64; N], b: &[f64; N]) -> Result<Option<[f64; N]>, GeodesicError> {
        let guess = self.combination(2.0, b, -1.0, a);
        Ok(zero(guess, |c| self.forces(a, b, c)))
    }

    fn midpoint(&mut self, a: &[f64; N], c: &[f64; N]) -> Result<Option<[f64; N]>, GeodesicError> {
        let guess = self.combination(0.5, a, 0.5, c);
        Ok(zero(guess, |b| self.forces(a, b, c)))
    }

    fn combination(&self, s: f64, x: &[f64; N], t: f64, y: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|i| s * x[i] + t * y[i])
    }
}

impl<W: Dissimilarity<N>, const N: usize> FiniteSpace<'_, W, N> {
    /// Returns `d_2 W(a, b)` and `d_1 W(b, c)`, whose sum vanishes on a geodesic.
    fn forces(&self, a: &[f64; N], b: &[f64; N], c: &[f64; N]) -> [SVector<f64, N>; 2] {
        let w = self.dissimilarity;
        [w.gradients(a, b).1.into(), w.gradients(b, c).0.into()]
    }
}

/// Finds the point near a guess at which the sum of two forces vanishes.
fn zero<const N: usize>(
    guess: [f64; N],
    forces: impl Fn(&[f64; N]) -> [SVector<f64, N>; 2],
) -> Option<[f64; N]> {
    let residual = |x: &SVector<f64, N>| {
        let [arriving, leaving] = forces(&(*x).into());
        arriving + leaving
    };
    let mut x = SVector::from(guess);
    let scale = x.amax().max(f64::MIN_POSITIVE);
    let h = DIFFERENCE * scale;
    let mut found = residual(&x);
    for _ in 0..MOST_STEPS {
        let mut jacobian = SMatrix::<f64, N, N>::zeros();
        for i in 0..N {
            let mut shift = SVector::<f64, N>::zeros();
            shift[i] = h;
            let difference = residual(&(x + shift)) - residual(&(x - shift));
            jacobian.set_column(i, &(difference / (2.0 * h)));
        }
        let step = jacobian.try_inverse()? * found;
        let lower = |halvings: i32| {
            let next = x - step * 0.5f64.powi(halvings);
            let residual = residual(&next);
            (residual.norm() < found.norm()).then_some((next, residual))
        };
        // The last digits of the residual are noise: if no step decreases it, the equation is
        // solved.
        let Some(next) = (0..MOST_HALVINGS).find_map(lower) else {
            break;
        };
        (x, found) = next;
        if step.norm() <= ROUNDING * scale {
            break;
        }
    }
    let [arriving, leaving] = forces(&x.into());
    let balanced = found.norm() <= BALANCED * (arriving.norm() + leaving.norm());
    balanced.then(|| x.into())
}

/// The calculus in closed form, in coordinates of the chart.
impl StereographicSphere {
    /// Returns the point at time one of the great circle that leaves `x` with the velocity `v`.
    pub fn exponential(x: &[f64; 2], v: &[f64; 2]) -> [f64; 2] {
        let (p, direction) = (lifted(x), pushed(x, v));
        let angle = direction.norm();
        if angle == 0.0 {
            return *x;
        }
        let end = p * angle.cos() + direction * (angle.sin() / angle);
        let below = 1.0 - end.z;
        [end.x / below, end.y / below]
    }

    /// Returns the velocity at `x` of the great circle that is at `y` at time one; zero if `y` is
    /// `x` or its antipode.
    pub fn logarithm(x: &[f64; 2], y: &[f64; 2]) -> [f64; 2] {
        let (p, q) = (lifted(x), lifted(y));
        let across = q - p * p.dot(&q);
        let size = across.norm();
        if size == 0.0 {
            return [0.0; 2];
        }
        pulled(x, &(across * (Self::distance(x, y) / size)))
    }

    /// Transports the tangent vector `v` at `x` parallel along the shortest great circle to `y`.
    pub fn transport(x: &[f64; 2], y: &[f64; 2], v: &[f64; 2]) -> [f64; 2] {
        let (p, q) = (lifted(x), lifted(y));
        let w = pushed(x, v);
        let moved = w - (p + q) * (q.dot(&w) / (1.0 + p.dot(&q)));
        pulled(y, &moved)
    }
}

/// Returns the point of the sphere that corresponds to a point of the chart.
fn lifted(x: &[f64; 2]) -> Vector3<f64> {
    let square = x[0] * x[0] + x[1] * x[1];
    Vector3::new(2.0 * x[0], 2.0 * x[1], square - 1.0) / (1.0 + square)
}

/// Maps a tangent vector of the chart to the sphere.
fn pushed(x: &[f64; 2], v: &[f64; 2]) -> Vector3<f64> {
    let (x, v) = (Vector2::from(*x), Vector2::from(*v));
    let below = 1.0 + x.norm_squared();
    let along = 2.0 * x.dot(&v);
    let flat = v * (2.0 / below) - x * (2.0 * along / (below * below));
    Vector3::new(flat.x, flat.y, 2.0 * along / (below * below))
}

/// Maps a tangent vector of the sphere at `x` to the chart: the inverse of [`pushed`], whose
/// columns are orthogonal and of length `2 / (1 + |x|^2)`.
fn pulled(x: &[f64; 2], w: &Vector3<f64>) -> [f64; 2] {
    let half = 0.5 * (1.0 + x[0] * x[0] + x[1] * x[1]);
    [[1.0, 0.0], [0.0, 1.0]].map(|unit| half * half * pushed(x, &unit).dot(w))
}
