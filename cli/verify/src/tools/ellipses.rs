//! Ellipses that deform affinely: a shape space of two dimensions.

use std::f64::consts::PI;

use geodesic::finite::Dissimilarity;
use hyperelastic::{LameModuli, LawSpec};

use super::matrices::stretches;
use super::pointwise::{density, response};

/// Ellipses about one centre, by their half-axes; an affine deformation carries each to the next.
pub struct Ellipses {
    /// The law.
    pub law: LawSpec,
}

impl Dissimilarity<2> for Ellipses {
    fn value(&self, a: &[f64; 2], b: &[f64; 2]) -> f64 {
        let h = stretches([b[0] / a[0], b[1] / a[1]]);
        PI * a[0] * a[1] * density(&self.law, &h).unwrap_or(f64::INFINITY)
    }

    fn gradients(&self, a: &[f64; 2], b: &[f64; 2]) -> ([f64; 2], [f64; 2]) {
        let h = stretches([b[0] / a[0], b[1] / a[1]]);
        let Ok(found) = response(&self.law, &h, &h) else {
            return ([f64::NAN; 2], [f64::NAN; 2]);
        };
        let area = PI * a[0] * a[1];
        let by_b: [f64; 2] = std::array::from_fn(|i| area * found.stress[i][i] / a[i]);
        let by_a = std::array::from_fn(|i| area * found.value / a[i] - by_b[i] * b[i] / a[i]);
        (by_a, by_b)
    }
}

/// The metric of the fluid on ellipses, at the midpoint of every step: its geodesics tend to those
/// of the metric with the second order, and know nothing of elasticity.
pub struct FluidMetric {
    /// Its moduli.
    pub moduli: LameModuli,
}

impl FluidMetric {
    /// `π m₁ m₂ diss[diag(d/m)]` with its derivatives by `m` and `d`.
    fn at(&self, m: [f64; 2], d: [f64; 2]) -> (f64, [f64; 2], [f64; 2]) {
        let rate = [d[0] / m[0], d[1] / m[1]];
        let (lambda, mu) = (self.moduli.lambda, self.moduli.mu);
        let trace = rate[0] + rate[1];
        let area = PI * m[0] * m[1];
        let diss = 0.5 * lambda * trace * trace + mu * (rate[0].powi(2) + rate[1].powi(2));
        let by_d: [f64; 2] =
            std::array::from_fn(|i| area * (lambda * trace + 2.0 * mu * rate[i]) / m[i]);
        let by_m = std::array::from_fn(|i| area * diss / m[i] - by_d[i] * rate[i]);
        (area * diss, by_m, by_d)
    }
}

impl Dissimilarity<2> for FluidMetric {
    fn value(&self, a: &[f64; 2], b: &[f64; 2]) -> f64 {
        let m = std::array::from_fn(|i| 0.5 * (a[i] + b[i]));
        self.at(m, [b[0] - a[0], b[1] - a[1]]).0
    }

    fn gradients(&self, a: &[f64; 2], b: &[f64; 2]) -> ([f64; 2], [f64; 2]) {
        let m = std::array::from_fn(|i| 0.5 * (a[i] + b[i]));
        let (_, by_m, by_d) = self.at(m, [b[0] - a[0], b[1] - a[1]]);
        (
            std::array::from_fn(|i| 0.5 * by_m[i] - by_d[i]),
            std::array::from_fn(|i| 0.5 * by_m[i] + by_d[i]),
        )
    }
}
