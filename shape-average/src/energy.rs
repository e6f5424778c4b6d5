//! The terms of the functional
//!
//! ```text
//! E = sum_i lambda_i W_i[phi_i] + (gamma / n) sum_i F[v o phi_i, v_i] + mu_L L[v].
//! ```

use crate::Mean;

/// The terms of the functional, without their weights, and their weighted sum.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Energy {
    /// The functional: the weighted sum of the terms (of what [`Mean`] makes of the elastic ones),
    /// without the barrier.
    pub total: f64,
    /// Elastic energy `W_i` of each shape.
    pub elastic: Vec<f64>,
    /// Mismatch `F_i` of each shape.
    pub mismatch: Vec<f64>,
    /// Interface length `L` of the average.
    pub length: f64,
    /// The barrier against folding, which the minimiser adds to the functional: zero where all
    /// determinants lie above its onset.
    pub barrier: f64,
}

/// Smoothing of the median: `s^2` as a share of the reference energy.
const SMOOTHING: f64 = 0.01;

impl Mean {
    fn squares(self) -> Option<(f64, f64)> {
        match self {
            Self::Arithmetic => None,
            Self::Median { reference } => {
                let reference = reference.unwrap_or(1.0);
                Some((reference, SMOOTHING * reference))
            }
        }
    }

    /// What an elastic energy counts.
    pub(crate) fn term(self, energy: f64) -> f64 {
        self.squares().map_or(energy, |(reference, smoothing)| {
            // The difference of the roots, without cancellation.
            let roots = (energy + smoothing).sqrt() + smoothing.sqrt();
            2.0 * reference.sqrt() * energy / roots
        })
    }

    /// The derivative of the term: what reweights a shape.
    pub(crate) fn slope(self, energy: f64) -> f64 {
        self.squares().map_or(1.0, |(reference, smoothing)| {
            (reference / (energy + smoothing)).sqrt()
        })
    }
}

/// The weights of the terms.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Weights {
    /// `lambda_i`.
    pub shapes: Vec<f64>,
    /// What of the elastic energies is summed.
    pub mean: Mean,
    /// `gamma / n`.
    pub mismatch: f64,
    /// `mu_L`.
    pub length: f64,
}

/// What one shape adds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShapeTerms {
    /// Elastic energy.
    pub elastic: f64,
    /// Mismatch.
    pub mismatch: f64,
    /// Barrier against folding, with its weight.
    pub barrier: f64,
}

impl Energy {
    /// What the minimiser lowers.
    pub fn objective(&self) -> f64 {
        self.total + self.barrier
    }

    pub(crate) fn new(weights: &Weights, terms: &[ShapeTerms], length: f64) -> Self {
        let elastic: Vec<f64> = terms.iter().map(|t| t.elastic).collect();
        let mismatch: Vec<f64> = terms.iter().map(|t| t.mismatch).collect();
        let barrier = terms.iter().map(|t| t.barrier).sum();
        let elastic_sum: f64 = elastic
            .iter()
            .zip(&weights.shapes)
            .map(|(w, l)| weights.mean.term(*w) * l)
            .sum();
        let mismatch_sum: f64 = mismatch.iter().sum();
        let total = elastic_sum + weights.mismatch * mismatch_sum + weights.length * length;
        Self {
            total,
            elastic,
            mismatch,
            length,
            barrier,
        }
    }
}
