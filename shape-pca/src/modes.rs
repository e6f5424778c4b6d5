//! Modes from a Gram matrix, and scores computed from it.

use crate::error::PcaError;
use crate::mahalanobis::Mahalanobis;
use crate::sample::SampleSize;
use fe_grid::mutant;
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
    /// All eigenvalues, largest first; for centred displacements at least one is zero, up to
    /// rounding.
    pub eigenvalues: Vec<f64>,
    /// `[j][i]`: coefficient of displacement `i` in mode `j`. There is one mode per nonzero
    /// eigenvalue.
    pub combinations: Vec<Vec<f64>>,
}

impl Modes {
    /// Computes the modes from the Gram matrix `g(u_i, u_j)` of centred displacements, with their
    /// weights; eigenvalues below a fraction of the first count as zero, and at most `most` modes
    /// are computed.
    ///
    /// # Errors
    /// [`PcaError::NoVariation`] if all displacements are zero; [`PcaError::TooFewShapes`].
    ///
    /// # Panics
    /// Unless the matrix has a row and a column for each weight.
    pub fn new(
        gram: &DMatrix<f64>,
        weights: &[f64],
        zero: f64,
        most: usize,
    ) -> Result<Self, PcaError> {
        let n = weights.len();
        assert_eq!(
            gram.shape(),
            (n, n),
            "a row, a column and a weight for each shape"
        );
        if n < 2 {
            return Err(PcaError::TooFewShapes { found: n });
        }
        let covariance = DMatrix::from_fn(n, n, |i, j| {
            (weights[i] * weights[j]).sqrt() * f64::midpoint(gram[(i, j)], gram[(j, i)])
        });
        let found = SymmetricEigen::new(covariance);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| found.eigenvalues[j].total_cmp(&found.eigenvalues[i]));
        let eigenvalues: Vec<f64> = order.iter().map(|&i| found.eigenvalues[i]).collect();
        let first = eigenvalues.first().copied().unwrap_or(0.0);
        // Displacements of this size are due to rounding.
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
                parts
                    .map(|(o, w)| scale * mutant!(w.sqrt(), ModesWeight => 1.0) * o)
                    .collect()
            })
            .collect();
        Ok(Self {
            eigenvalues,
            combinations,
        })
    }

    /// Returns the number of modes.
    pub fn rank(&self) -> usize {
        self.combinations.len()
    }

    /// Returns the cumulative sums of the eigenvalues, as fractions of the total: the compactness.
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

/// Returns the sign that makes the largest training score, `O_ij / sqrt(lambda_i)`, positive; of
/// two that are equal up to rounding the first counts.
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

/// Coordinates of a shape with respect to the modes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scores {
    /// Scores in standard deviations, one per mode.
    pub scores: Vec<f64>,
    /// Distance from the average in standard deviations.
    #[serde(flatten)]
    pub mahalanobis: Mahalanobis,
    /// `|u|` in the inner product of the analysis.
    pub norm: f64,
    /// `|u - sum_(j < m) g(u, y_j) y_j|` for `m = 0, 1, ...` up to all modes.
    pub errors: Vec<f64>,
}

impl Scores {
    /// Computes the scores from the products `g(u, y_j)`, the square `g(u, u)`, the eigenvalues of
    /// the modes and the number of training shapes.
    pub fn new(products: &[f64], square: f64, eigenvalues: &[f64], sample: SampleSize) -> Self {
        let scores: Vec<f64> = products
            .iter()
            .zip(eigenvalues)
            .map(|(g, l)| g / mutant!(l.sqrt(), ScoresVariance => *l))
            .collect();
        let mut left = square;
        let mut errors = vec![left.max(0.0).sqrt()];
        for g in products {
            left -= g * g;
            errors.push(left.max(0.0).sqrt());
        }
        Self {
            mahalanobis: Mahalanobis::new(&scores, eigenvalues, sample),
            norm: square.max(0.0).sqrt(),
            scores,
            errors,
        }
    }

    /// Returns the relative error of the projection onto all modes.
    pub fn residual(&self) -> f64 {
        let left = self.errors.last().copied().unwrap_or(0.0);
        if self.norm > 0.0 {
            left / self.norm
        } else {
            0.0
        }
    }
}
