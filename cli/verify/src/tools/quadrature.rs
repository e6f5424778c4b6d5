//! Gauss rules, for reference values that no grid has touched.

use std::f64::consts::{PI, TAU};

/// Points and weights of a rule on an interval.
#[derive(Clone, Debug)]
pub struct Rule(Vec<(f64, f64)>);

impl Rule {
    /// The rule of Gauss and Legendre with `n` points on `[a, b]`, by Newton's method.
    pub fn gauss(n: usize, a: f64, b: f64) -> Self {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let point = |i: usize| {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..50 {
                let (value, derivative) = legendre(n, x);
                slope = derivative;
                let step = value / derivative;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            let weight = 2.0 / ((1.0 - x * x) * slope * slope);
            (middle + half * x, half * weight)
        };
        Self((0..n).map(point).collect())
    }

    /// The rule repeated on equal parts.
    pub fn composite(parts: usize, n: usize, a: f64, b: f64) -> Self {
        let width = (b - a) / parts as f64;
        let pieces = (0..parts).flat_map(|i| {
            let left = a + i as f64 * width;
            Self::gauss(n, left, left + width).0
        });
        Self(pieces.collect())
    }

    /// The integral of a function.
    pub fn integral(&self, mut f: impl FnMut(f64) -> f64) -> f64 {
        self.0.iter().map(|&(x, w)| w * f(x)).sum()
    }

    /// Points and weights.
    pub fn points(&self) -> &[(f64, f64)] {
        &self.0
    }
}

/// The Legendre polynomial of degree `n` and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        let next = ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k;
        (before, value) = (value, next);
    }
    let slope = n as f64 * (x * value - before) / (x * x - 1.0);
    (value, slope)
}

/// Points and weights on the disk of a radius about the origin: Gauss along the radius, even in the
/// angle; exact for polynomials up to degree `2 n - 2` or so.
pub fn disk(n: usize, radius: f64) -> Vec<([f64; 2], f64)> {
    let angles = 2 * n;
    let mut points = Vec::with_capacity(n * angles);
    for &(r, w) in Rule::gauss(n, 0.0, radius).points() {
        for k in 0..angles {
            let (sin, cos) = (TAU * k as f64 / angles as f64).sin_cos();
            points.push(([r * cos, r * sin], w * r * TAU / angles as f64));
        }
    }
    points
}

/// The mean over the angle of a smooth periodic function, from `n` even samples.
pub fn around(n: usize, f: impl Fn(f64) -> f64) -> f64 {
    (0..n).map(|k| f(TAU * k as f64 / n as f64)).sum::<f64>() * TAU / n as f64
}
