//! From a Gram matrix to modes, and what is made of numbers alone.

use crate::error::PcaError;
use nalgebra::{DMatrix, SymmetricEigen};
use serde::Serialize;

/// Eigenvalues, and modes as combinations of the training displacements.
///
/// With weights `lambda_i` the covariance is `C_ij = sqrt(lambda_i lambda_j) g(u_i, u_j)`, for equal
/// ones `g(u_i, u_j)/n`; `C = O Lambda O^T`. The modes `y_j = sum_i sqrt(lambda_i) O_ij u_i /
/// sqrt(Lambda_j)` are orthonormal. The sign of a mode is such that the largest training score is
/// positive.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Modes {
    /// All eigenvalues, the largest first; of centred displacements at least one is zero, up to
    /// rounding.
    pub eigenvalues: Vec<f64>,
    /// `[j][i]`: what displacement `i` adds to mode `j`. There are as many modes as eigenvalues
    /// that are not zero.
    pub combinations: Vec<Vec<f64>>,
}

impl Modes {
    /// Of the Gram matrix `g(u_i, u_j)` of displacements that are centred, with their weights;
    /// eigenvalues below a share of the first are zero, and no more than `most` modes are made.
    ///
    /// # Errors
    /// [`PcaError::NoVariation`] where all displacements are zero.
    pub fn new(
        gram: &DMatrix<f64>,
        weights: &[f64],
        zero: f64,
        most: usize,
    ) -> Result<Self, PcaError> {
        let n = weights.len();
        let covariance = DMatrix::from_fn(n, n, |i, j| {
            (weights[i] * weights[j]).sqrt() * f64::midpoint(gram[(i, j)], gram[(j, i)])
        });
        let found = SymmetricEigen::new(covariance);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| found.eigenvalues[j].total_cmp(&found.eigenvalues[i]));
        let eigenvalues: Vec<f64> = order.iter().map(|&i| found.eigenvalues[i]).collect();
        let first = eigenvalues.first().copied().unwrap_or(0.0);
        // Displacements of this size are what rounding makes of none.
        if first.is_nan() || first <= 1e-24 {
            return Err(PcaError::NoVariation);
        }
        let kept = eigenvalues.iter().take_while(|l| **l > zero * first);
        let rank = kept.count().min(n - 1).min(most);
        let combinations = (0..rank)
            .map(|j| {
                let column: Vec<f64> = (0..n).map(|i| found.eigenvectors[(i, order[j])]).collect();
                let sign = leading_sign(&column, weights);
                let scale = sign / eigenvalues[j].sqrt();
                let parts = column.iter().zip(weights);
                parts.map(|(o, w)| scale * w.sqrt() * o).collect()
            })
            .collect();
        Ok(Self {
            eigenvalues,
            combinations,
        })
    }

    /// Number of modes.
    pub fn rank(&self) -> usize {
        self.combinations.len()
    }

    /// Sums of the first eigenvalues, as shares of the sum of all: how compact the model is.
    pub fn compactness(&self) -> Vec<f64> {
        let total: f64 = self.eigenvalues.iter().map(|l| l.max(0.0)).sum();
        let mut sum = 0.0;
        self.eigenvalues[..self.rank()]
            .iter()
            .map(|l| {
                sum += l;
                sum / total
            })
            .collect()
    }
}

/// The sign that makes the largest training score, `O_ij / sqrt(lambda_i)`, positive; of two that
/// are equal up to rounding the first counts.
fn leading_sign(column: &[f64], weights: &[f64]) -> f64 {
    let mut largest = 0.0f64;
    for (o, w) in column.iter().zip(weights) {
        let score = if *w > 0.0 { o / w.sqrt() } else { 0.0 };
        if score.abs() > largest.abs() * (1.0 + 1e-6) {
            largest = score;
        }
    }
    if largest < 0.0 { -1.0 } else { 1.0 }
}

/// Where a shape lies among the modes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scores {
    /// In standard deviations, one a mode.
    pub scores: Vec<f64>,
    /// `d_M = sqrt((1/n) sum_j score_j^2)`.
    pub mahalanobis: f64,
    /// `|u|` in the inner product of the analysis.
    pub norm: f64,
    /// `|u - sum_(j < m) g(u, y_j) y_j|` for `m = 0, 1, ...` up to all modes.
    pub errors: Vec<f64>,
}

impl Scores {
    /// From the products `g(u, y_j)`, the square `g(u, u)`, the eigenvalues of the modes and the
    /// number of training shapes.
    pub fn new(products: &[f64], square: f64, eigenvalues: &[f64], n_shapes: usize) -> Self {
        let scores: Vec<f64> = products
            .iter()
            .zip(eigenvalues)
            .map(|(g, l)| g / l.sqrt())
            .collect();
        let sum: f64 = scores.iter().map(|s| s * s).sum();
        let mut left = square;
        let mut errors = vec![left.max(0.0).sqrt()];
        for g in products {
            left -= g * g;
            errors.push(left.max(0.0).sqrt());
        }
        Self {
            mahalanobis: (sum / n_shapes as f64).sqrt(),
            norm: square.max(0.0).sqrt(),
            scores,
            errors,
        }
    }

    /// What all modes together leave of the displacement, relative.
    pub fn residual(&self) -> f64 {
        let left = self.errors.last().copied().unwrap_or(0.0);
        if self.norm > 0.0 {
            left / self.norm
        } else {
            0.0
        }
    }
}
