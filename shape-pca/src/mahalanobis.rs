//! Mahalanobis distances.

use fe_grid::mutant;
use serde::Serialize;
use statrs::function::gamma::gamma_ur;

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
    /// Probability of at least this distance for normally distributed shapes of these variances: the
    /// square of the distance has a chi-squared distribution. Variances of few training shapes are
    /// uncertain, so that it is too small for few shapes.
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
            p_value: chi_squared_survival(square, degrees_of_freedom),
            over_n: (all / mutant!(n_shapes, MahalanobisCount => n_shapes - 1) as f64).sqrt(),
        }
    }
}

/// The probability that a sum of squares of independent standard normal variables is at least `square`:
/// `Q(k/2, square/2)` with the regularised upper incomplete gamma function.
fn chi_squared_survival(square: f64, degrees_of_freedom: usize) -> f64 {
    if degrees_of_freedom == 0 || square <= 0.0 {
        return 1.0;
    }
    if !square.is_finite() {
        return if square.is_nan() { f64::NAN } else { 0.0 };
    }
    gamma_ur(0.5 * degrees_of_freedom as f64, 0.5 * square)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn p_values_are_those_of_the_tables() {
        // Critical values of the chi-squared distribution, to the digits of printed tables.
        for (degrees, critical, p) in [
            (1, 3.841, 0.05),
            (2, 5.991, 0.05),
            (5, 15.086, 0.01),
            (10, 18.307, 0.05),
            (30, 59.703, 0.001),
        ] {
            let found = chi_squared_survival(critical, degrees);
            assert!((found / p - 1.0).abs() < 1e-3, "{degrees}: {found}");
        }
        // Two degrees: exp(-x/2).
        assert!((chi_squared_survival(3.0, 2) - (-1.5f64).exp()).abs() < 1e-14);
        assert_eq!(chi_squared_survival(0.0, 3), 1.0);
        assert_eq!(chi_squared_survival(f64::INFINITY, 3), 0.0);
        assert!(chi_squared_survival(f64::NAN, 3).is_nan());
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
