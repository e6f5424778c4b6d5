//! Discrete geodesics in finite dimensions: the time discretisation without the shapes.
//!
//! A path `x_0, ..., x_K` of points of `R^N` minimises `K sum_k W(x_{k-1}, x_k)`, where
//! `W(a, b)` approximates the squared Riemannian distance of close points. Properties of the
//! discretisation can be tested here where solutions are known: on the sphere in its stereographic
//! chart, for balls of viscous matter that remain balls, and for points joined by dashpots.
//!
//! Source: the lecture notes of Rumpf and Wirth, "variational time discretization in finite
//! dimensions", and "springs or dashpots".

use crate::cells;
use crate::error::GeodesicError;
use fe_grid::mutant;
use hyperelastic::{CompiledLaw, LawSpec};
use nalgebra::{DMatrix, DVector};

/// Maximal number of Newton steps.
const MOST_STEPS: usize = 100;
/// Maximal number of halvings of a step.
const MOST_HALVINGS: usize = 40;
/// Tolerance for the norm of the gradient, relative to the first one.
const TOLERANCE: f64 = 1e-13;
/// Step of the finite differences of gradients, relative to the size of the points.
const DIFFERENCE: f64 = 1e-6;

/// An approximation of a squared distance: `W(a, a) = 0`, and `W(a, b)` is close to
/// `g_a(b - a, b - a)` for close points.
pub trait Dissimilarity<const N: usize> {
    /// Returns `W(a, b)`; infinite if it is not defined.
    fn value(&self, a: &[f64; N], b: &[f64; N]) -> f64;

    /// Returns its derivatives with respect to `a` and `b`.
    fn gradients(&self, a: &[f64; N], b: &[f64; N]) -> ([f64; N], [f64; N]);
}

/// A discrete geodesic.
#[derive(Clone, Debug, PartialEq)]
pub struct FinitePath<const N: usize> {
    /// The points `x_0, ..., x_K`.
    pub points: Vec<[f64; N]>,
    /// The step energies `W(x_{k-1}, x_k)`.
    pub step_energies: Vec<f64>,
}

impl<const N: usize> FinitePath<N> {
    fn new<W: Dissimilarity<N>>(dissimilarity: &W, points: Vec<[f64; N]>) -> Self {
        let step_energies = points
            .windows(2)
            .map(|pair| dissimilarity.value(&pair[0], &pair[1]))
            .collect();
        Self {
            points,
            step_energies,
        }
    }

    /// Returns `sum sqrt W_k`.
    pub fn length(&self) -> f64 {
        cells::length(&self.step_energies)
    }

    /// Returns `K sum W_k`.
    pub fn dissipation(&self) -> f64 {
        cells::dissipation(&self.step_energies)
    }
}

/// Computes the discrete geodesic of `K` steps between two points by Newton's method from the
/// straight line.
///
/// # Errors
/// [`GeodesicError::Parameter`] for zero steps, points that are not finite, and an end that no path of finite length
/// reaches.
pub fn finite_geodesic<W: Dissimilarity<N>, const N: usize>(
    dissimilarity: &W,
    start: [f64; N],
    end: [f64; N],
    steps: usize,
) -> Result<FinitePath<N>, GeodesicError> {
    if steps == 0 {
        return Err(GeodesicError::Parameter {
            name: "steps",
            expected: "at least 1",
            value: 0.0,
        });
    }
    for (name, point) in [("start", start), ("end", end)] {
        if let Some(&value) = point.iter().find(|x| !x.is_finite()) {
            let expected = "a point of finite coordinates";
            return Err(GeodesicError::Parameter {
                name,
                expected,
                value,
            });
        }
    }
    let mut points: Vec<[f64; N]> = (0..=steps)
        .map(|k| {
            let t = k as f64 / steps as f64;
            std::array::from_fn(|i| (1.0 - t) * start[i] + t * end[i])
        })
        .collect();
    let scale = points.iter().flatten().fold(0.0f64, |a, x| a.max(x.abs()));
    let mut first = None;
    for _ in 0..MOST_STEPS {
        let gradient = path_gradient(dissimilarity, &points);
        let norm = gradient.norm();
        let reference = *first.get_or_insert(norm);
        if norm <= TOLERANCE * reference || steps == 1 || reference == 0.0 {
            break;
        }
        let Some(direction) = newton_direction(dissimilarity, &points, &gradient, scale) else {
            break;
        };
        if !advance(dissimilarity, &mut points, &direction, norm) {
            break;
        }
    }
    let path = FinitePath::new(dissimilarity, points);
    let value = path.length();
    if !value.is_finite() {
        return Err(GeodesicError::Parameter {
            name: "length",
            expected: "finite: the end may not be reached from the start",
            value,
        });
    }
    Ok(path)
}

/// Computes the derivative of `sum W` with respect to the inner points.
fn path_gradient<W: Dissimilarity<N>, const N: usize>(
    dissimilarity: &W,
    points: &[[f64; N]],
) -> DVector<f64> {
    let inner = points.len() - 2;
    let mut gradient = DVector::zeros(N * inner);
    for (k, pair) in points.windows(2).enumerate() {
        let (by_a, by_b) = dissimilarity.gradients(&pair[0], &pair[1]);
        for i in 0..N {
            if k > 0 {
                gradient[(k - 1) * N + i] += by_a[i];
            }
            if k < inner {
                gradient[k * N + i] += by_b[i];
            }
        }
    }
    gradient
}

/// Computes `-H^-1 g` with a finite-difference Hessian, shifted to be positive definite if it is
/// not.
fn newton_direction<W: Dissimilarity<N>, const N: usize>(
    dissimilarity: &W,
    points: &[[f64; N]],
    gradient: &DVector<f64>,
    scale: f64,
) -> Option<DVector<f64>> {
    let n = gradient.len();
    let h = DIFFERENCE * scale.max(1e-300);
    let mut hessian = DMatrix::zeros(n, n);
    let mut moved = points.to_vec();
    for column in 0..n {
        let (k, i) = (column / N + 1, column % N);
        moved[k][i] += h;
        let above = path_gradient(dissimilarity, &moved);
        moved[k][i] -= 2.0 * h;
        let below = path_gradient(dissimilarity, &moved);
        moved[k][i] = points[k][i];
        hessian.set_column(column, &((above - below) / (2.0 * h)));
    }
    let mut hessian: DMatrix<f64> = (&hessian + hessian.transpose()) * 0.5;
    let mut shift = 1e-12 * hessian.amax();
    for _ in 0..60 {
        if let Some(factor) = hessian.clone().cholesky() {
            return Some(-factor.solve(gradient));
        }
        for i in 0..n {
            hessian[(i, i)] += shift;
        }
        shift *= 4.0;
    }
    None
}

/// Takes the longest of the halved steps that decreases the norm of the gradient or the energy.
fn advance<W: Dissimilarity<N>, const N: usize>(
    dissimilarity: &W,
    points: &mut Vec<[f64; N]>,
    direction: &DVector<f64>,
    norm: f64,
) -> bool {
    let energy = |points: &[[f64; N]]| {
        let pairs = points.windows(2);
        pairs
            .map(|p| dissimilarity.value(&p[0], &p[1]))
            .sum::<f64>()
    };
    let before = energy(points);
    let mut factor = 1.0;
    for _ in 0..MOST_HALVINGS {
        let mut trial = points.clone();
        for (index, d) in direction.iter().enumerate() {
            trial[index / N + 1][index % N] += factor * d;
        }
        let after = energy(&trial);
        let shorter = after.is_finite() && path_gradient(dissimilarity, &trial).norm() < norm;
        if after < before || shorter {
            *points = trial;
            return true;
        }
        factor *= 0.5;
    }
    false
}

/// Evaluation point of the metric of a chart in a dissimilarity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// `g_a(b - a, b - a)`: not symmetric, of first order.
    Left,
    /// `g_m(b - a, b - a)` at the midpoint `m`: symmetric, of second order.
    Midpoint,
}

/// The unit sphere in the stereographic chart, `g_x(v, v) = 4 |v|^2 / (1 + |x|^2)^2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereographicSphere {
    /// Evaluation point of the metric.
    pub rule: Rule,
}

impl StereographicSphere {
    /// Returns the distance along the great circle.
    pub fn distance(a: &[f64; 2], b: &[f64; 2]) -> f64 {
        let lift = |x: &[f64; 2]| {
            let s = x[0] * x[0] + x[1] * x[1];
            [2.0 * x[0], 2.0 * x[1], s - 1.0].map(|y| y / (1.0 + s))
        };
        let (p, q) = (lift(a), lift(b));
        let chord = (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt();
        2.0 * (0.5 * chord).min(1.0).asin()
    }

    fn base(self, a: &[f64; 2], b: &[f64; 2]) -> [f64; 2] {
        match self.rule {
            Rule::Left => *a,
            Rule::Midpoint => std::array::from_fn(|i| 0.5 * (a[i] + b[i])),
        }
    }
}

impl Dissimilarity<2> for StereographicSphere {
    fn value(&self, a: &[f64; 2], b: &[f64; 2]) -> f64 {
        let m = self.base(a, b);
        let below = 1.0 + m[0] * m[0] + m[1] * m[1];
        let squared = (b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2);
        4.0 * squared / mutant!(below * below, SphereMetric => below)
    }

    fn gradients(&self, a: &[f64; 2], b: &[f64; 2]) -> ([f64; 2], [f64; 2]) {
        let m = self.base(a, b);
        let below = 1.0 + m[0] * m[0] + m[1] * m[1];
        let squared = (b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2);
        let (share_a, share_b) = match self.rule {
            Rule::Left => (1.0, 0.0),
            Rule::Midpoint => (0.5, 0.5),
        };
        let (mut by_a, mut by_b) = ([0.0; 2], [0.0; 2]);
        for i in 0..2 {
            let along = 8.0 * (b[i] - a[i]) / (below * below);
            let by_base = -16.0 * squared * m[i] / (below * below * below);
            by_a[i] = share_a * by_base - along;
            by_b[i] = share_b * by_base + along;
        }
        (by_a, by_b)
    }
}

/// Concentric balls of viscous matter that remain balls: `W(r, s) = |B_r| W(s/r 1)`.
#[derive(Clone, Debug)]
pub struct Balls<const D: usize> {
    law: CompiledLaw<D>,
}

impl<const D: usize> Balls<D> {
    /// Creates the dissimilarity for a law.
    ///
    /// # Errors
    /// [`GeodesicError::Law`] if the law cannot be constructed.
    pub fn new(law: LawSpec) -> Result<Self, GeodesicError> {
        Ok(Self {
            law: law.compile()?,
        })
    }

    /// Returns `W(q 1)` and its derivative with respect to `q`.
    fn density(&self, q: f64) -> (f64, f64) {
        let mut strain = [[0.0; D]; D];
        for (i, row) in strain.iter_mut().enumerate() {
            row[i] = q - 1.0;
        }
        let (value, stress) = self.law.gradient(&strain);
        (value, (0..D).map(|i| stress[i][i]).sum())
    }

    /// Returns the volume of a ball.
    fn volume(radius: f64) -> f64 {
        let unit = if D == 2 {
            1.0
        } else {
            mutant!(4.0 / 3.0, BallVolume => 2.0)
        };
        unit * std::f64::consts::PI * radius.powi(D as i32)
    }
}

impl<const D: usize> Dissimilarity<1> for Balls<D> {
    fn value(&self, [r]: &[f64; 1], [s]: &[f64; 1]) -> f64 {
        if *r <= 0.0 || *s <= 0.0 {
            return f64::INFINITY;
        }
        Self::volume(*r) * self.density(s / r).0
    }

    fn gradients(&self, [r]: &[f64; 1], [s]: &[f64; 1]) -> ([f64; 1], [f64; 1]) {
        let q = s / r;
        let (value, slope) = self.density(q);
        let volume = Self::volume(*r);
        let by_r = volume * (D as f64 * value - q * slope) / r;
        ([by_r], [volume * slope / r])
    }
}

/// Points of the plane joined by dashpots: `W(a, b) = sum 2 mu (|b_i - b_j| - |a_i - a_j|)^2` over
/// all pairs, the energy that the dashpots dissipate when their lengths change at constant speed;
/// with springs in their place it is the energy stored. `N` is twice the number of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dashpots {
    /// Viscosity `mu` of a dashpot.
    pub viscosity: f64,
    /// A small resistance to moving a point, which removes the null space of rigid motions.
    pub ground: f64,
}

impl<const N: usize> Dissimilarity<N> for Dashpots {
    fn value(&self, a: &[f64; N], b: &[f64; N]) -> f64 {
        let length = |x: &[f64; N], i: usize, j: usize| {
            (x[2 * i] - x[2 * j]).hypot(x[2 * i + 1] - x[2 * j + 1])
        };
        let mut sum = 0.0;
        for i in 0..N / 2 {
            for j in 0..i {
                let factor = mutant!(2.0, DashpotFactor => 1.0);
                sum += factor * self.viscosity * (length(b, i, j) - length(a, i, j)).powi(2);
            }
        }
        sum + self.ground * (0..N).map(|i| (b[i] - a[i]).powi(2)).sum::<f64>()
    }

    fn gradients(&self, a: &[f64; N], b: &[f64; N]) -> ([f64; N], [f64; N]) {
        let (mut by_a, mut by_b) = ([0.0; N], [0.0; N]);
        for i in 0..N / 2 {
            for j in 0..i {
                let difference = |x: &[f64; N]| [x[2 * i] - x[2 * j], x[2 * i + 1] - x[2 * j + 1]];
                let (p, q) = (difference(a), difference(b));
                let (la, lb) = (p[0].hypot(p[1]), q[0].hypot(q[1]));
                let force = 4.0 * self.viscosity * (lb - la);
                for k in 0..2 {
                    let (from, to) = (force * p[k] / la, force * q[k] / lb);
                    by_a[2 * i + k] -= from;
                    by_a[2 * j + k] += from;
                    by_b[2 * i + k] += to;
                    by_b[2 * j + k] -= to;
                }
            }
        }
        for i in 0..N {
            let moved = 2.0 * self.ground * (b[i] - a[i]);
            by_a[i] -= moved;
            by_b[i] += moved;
        }
        (by_a, by_b)
    }
}
