//! Mahalanobis distances.

use fe_grid::mutant;
use serde::Serialize;
use statrs::function::beta::beta_reg;

/// Modes count if their variance is at least this share of the variance of all modes. Smaller ones
/// have standard deviations below a tenth of the sample's, which is the size of the errors of
/// deformations and of the differences between shapes of another grid: a division by them would
/// measure these errors.
pub const NEGLIGIBLE_VARIANCE: f64 = 0.01;

/// The distance of a shape from the average in standard deviations, and how unusual it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mahalanobis {
    /// `sqrt(sum_j score_j^2)`, over the modes whose variance is not negligible
    /// ([`NEGLIGIBLE_VARIANCE`]).
    #[serde(rename = "mahalanobis")]
    pub distance: f64,
    /// Number of these modes.
    pub degrees_of_freedom: usize,
    /// Probability of at least this distance for a new shape, if the shapes are normally distributed: for the
    /// square `D^2`, `n` training shapes and `k` degrees of freedom, `D^2 (n - k) / (k (n + 1))` has an F
    /// distribution with `k` and `n - k` degrees of freedom (Hotelling), since the average and the variances come
    /// from the training shapes, too. With many of them `D^2` has a chi-squared distribution.
    pub p_value: f64,
    /// `d_M = sqrt((1/n) sum_j score_j^2)` over all modes, with the number `n` of training shapes:
    /// the definition of the lecture notes. Training shapes have the mean square `(n-1)/n`.
    #[serde(rename = "mahalanobis_over_n")]
    pub over_n: f64,
}

impl Mahalanobis {
    /// Computes the distance from scores in standard deviations, the variances of all modes in
    /// descending order (at least as many), and the number of training shapes.
    pub fn new(scores: &[f64], variances: &[f64], n_shapes: usize) -> Self {
        let least = NEGLIGIBLE_VARIANCE * variances.iter().sum::<f64>();
        let counted = scores.iter().zip(variances).filter(|(_, v)| **v >= least);
        let degrees_of_freedom = counted.clone().count();
        let square: f64 = counted.map(|(s, _)| s * s).sum();
        let all: f64 = scores.iter().map(|s| s * s).sum();
        Self {
            distance: square.sqrt(),
            degrees_of_freedom,
            p_value: survival(square, degrees_of_freedom, n_shapes),
            over_n: (all / mutant!(n_shapes, MahalanobisCount => n_shapes - 1) as f64).sqrt(),
        }
    }

    /// The same distance as that of one of the training shapes, which cannot be far from an average and from
    /// variances that it is a part of: `D^2 / (n - 1)` has a beta distribution with the parameters `k / 2` and
    /// `(n - k - 1) / 2`. All distances are equal where there are as many modes as `n` shapes can have; then the
    /// p-value is 1.
    ///
    /// Source: R. Gnanadesikan and J. R. Kettenring, *Robust estimates, residuals, and outlier detection with
    /// multiresponse data*, Biometrics 28 (1972).
    #[must_use]
    pub fn of_training(self, n_shapes: usize) -> Self {
        let square = self.distance * self.distance;
        Self {
            p_value: survival_in_training(square, self.degrees_of_freedom, n_shapes),
            ..self
        }
    }
}

/// The probability that the squared distance of a new shape is at least `square`. The variances are those with
/// `1/n`, so that Hotelling's `T^2` of a prediction is `square (n - 1) / (n + 1)`.
///
/// Source: T. W. Anderson, *An introduction to multivariate statistical analysis*, chapter 5.
fn survival(square: f64, degrees_of_freedom: usize, n_shapes: usize) -> f64 {
    if degrees_of_freedom == 0 || n_shapes <= degrees_of_freedom || square <= 0.0 {
        return 1.0;
    }
    if !square.is_finite() {
        return if square.is_nan() { f64::NAN } else { 0.0 };
    }
    // `1 - x` of the incomplete beta function of the F distribution, without the ratio `F` itself.
    let (k, n) = (degrees_of_freedom as f64, n_shapes as f64);
    beta_reg(0.5 * (n - k), 0.5 * k, (n + 1.0) / (n + 1.0 + square))
}

/// The probability that the squared distance of one of the training shapes is at least `square`.
fn survival_in_training(square: f64, degrees_of_freedom: usize, n_shapes: usize) -> f64 {
    let (k, others) = (degrees_of_freedom, n_shapes.saturating_sub(1));
    if k == 0 || others <= k || square.is_nan() {
        return 1.0;
    }
    let share = (square / others as f64).clamp(0.0, 1.0);
    beta_reg(0.5 * (others - k) as f64, 0.5 * k as f64, 1.0 - share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::random::{SplitMix64, normal};

    #[test]
    fn p_values_are_those_of_the_tables() {
        // Critical values of the F distribution, to the digits of printed tables.
        for (k, others, critical, p) in [
            (1, 1, 161.4, 0.05),
            (2, 6, 5.143, 0.05),
            (5, 10, 5.636, 0.01),
            (10, 20, 2.348, 0.05),
        ] {
            let n = f64::from(k + others);
            let square = critical * f64::from(k) * (n + 1.0) / f64::from(others);
            let found = survival(square, k as usize, (k + others) as usize);
            assert!((found / p - 1.0).abs() < 1e-3, "{k}, {others}: {found}");
        }
        // Many training shapes: the chi-squared distribution, for two degrees exp(-x/2).
        let found = survival(3.0, 2, 1_000_000);
        assert!((found / (-1.5f64).exp() - 1.0).abs() < 1e-5);
        assert_eq!(survival(0.0, 3, 8), 1.0);
        assert_eq!(survival(f64::INFINITY, 3, 8), 0.0);
        assert!(survival(f64::NAN, 3, 8).is_nan());
        assert_eq!(survival(9.0, 3, 3), 1.0);
    }

    /// Checks that p-values below `p` are a share `p` of all cases, for the score of one of the training shapes or of a
    /// new one of their population, with few training shapes, too.
    fn check_uniform(seed: u64, is_new: bool) {
        let mut random = SplitMix64::new(seed);
        let mut normal = || normal(random.open_uniform(), random.uniform());
        for n in [3, 8, 20] {
            let cases = 20_000;
            let mut small = [0usize; 2];
            for _ in 0..cases {
                let training: Vec<f64> = (0..n).map(|_| normal()).collect();
                let mean = training.iter().sum::<f64>() / n as f64;
                let squares = training.iter().map(|x| (x - mean).powi(2));
                let variance = squares.sum::<f64>() / n as f64;
                let shape = if is_new { normal() } else { training[0] };
                let score = (shape - mean) / variance.sqrt();
                let found = Mahalanobis::new(&[score], &[variance], n);
                let p = if is_new {
                    found.p_value
                } else {
                    found.of_training(n).p_value
                };
                small[0] += usize::from(p < 0.05);
                small[1] += usize::from(p < 0.2);
            }
            // Four standard deviations of a share among so many cases: .006 and .011. By the law of the others,
            // three training shapes have no p-value below .05.
            let [least, less] = small.map(|count| count as f64 / f64::from(cases));
            assert!((least - 0.05).abs() < 0.008, "{n}: {least}");
            assert!((less - 0.2).abs() < 0.012, "{n}: {less}");
        }
    }

    #[test]
    fn p_values_of_new_shapes_are_uniform() {
        check_uniform(7, true);
    }

    #[test]
    fn p_values_of_training_shapes_are_uniform() {
        check_uniform(11, false);
        // As many modes as shapes can have, and none.
        let all = Mahalanobis::new(&[1.0, 1.0], &[1.0, 1.0], 3);
        assert_eq!(all.of_training(3).p_value, 1.0);
        assert_eq!(Mahalanobis::new(&[], &[], 3).of_training(3).p_value, 1.0);
    }

    #[test]
    fn one_standard_deviation_is_one_and_negligible_modes_do_not_count() {
        let variances = [9.0, 0.95, 0.05];
        let along = |scores: &[f64]| Mahalanobis::new(scores, &variances, 4);
        assert_eq!(along(&[1.0, 0.0, 0.0]).distance, 1.0);
        assert_eq!(along(&[3.0, 4.0, 0.0]).distance, 5.0);
        let noisy = along(&[3.0, 4.0, 12.0]);
        assert_eq!((noisy.distance, noisy.degrees_of_freedom), (5.0, 2));
        assert_eq!(noisy.over_n, 6.5);
        // The first modes alone.
        assert_eq!(along(&[2.0]).degrees_of_freedom, 1);
    }
}
