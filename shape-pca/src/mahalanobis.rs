//! Mahalanobis distances.

use fe_grid::mutant;
use serde::Serialize;
use statrs::function::beta::beta_reg;

use crate::sample::SampleSize;

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
    /// from the training shapes, too. With many of them `D^2` has a chi-squared distribution. Where their weights
    /// differ, `D^2 (1 - 1/n) / (1 + 1/n) (f - k + 1) / (k f)` has `k` and `f - k + 1` degrees of freedom about, with
    /// [`SampleSize::effective`] in place of `n` and `f` of [`SampleSize::degrees_of_freedom`]: p-values are rather
    /// too large then, and 1 where `f` is below `k`.
    pub p_value: f64,
    /// `d_M = sqrt((1/n) sum_j score_j^2)` over all modes, with the number `n` of training shapes whose weight is not
    /// zero: the definition of the lecture notes. Training shapes have the mean square `(n-1)/n`.
    #[serde(rename = "mahalanobis_over_n")]
    pub over_n: f64,
}

impl Mahalanobis {
    /// Computes the distance from scores in standard deviations, the variances of all modes in
    /// descending order (at least as many), and the number of training shapes.
    pub fn new(scores: &[f64], variances: &[f64], sample: SampleSize) -> Self {
        let least = NEGLIGIBLE_VARIANCE * variances.iter().sum::<f64>();
        let counted = scores.iter().zip(variances).filter(|(_, v)| **v >= least);
        let degrees_of_freedom = counted.clone().count();
        let square: f64 = counted.map(|(s, _)| s * s).sum();
        let all: f64 = scores.iter().map(|s| s * s).sum();
        let n = sample.shapes as f64;
        Self {
            distance: square.sqrt(),
            degrees_of_freedom,
            p_value: survival(square, degrees_of_freedom, sample),
            over_n: (all / mutant!(n, MahalanobisCount => n - 1.0)).sqrt(),
        }
    }

    /// The same distance as that of one of the training shapes, which cannot be far from an average and from
    /// variances that it is a part of, with its weight and the size of the sample of the others.
    ///
    /// A shape of weight `w` whose squared distance is `D^2` has that of `q = D^2 / (1 - w - w D^2)` from the average
    /// of the others, for which it is new. With equal weights `D^2 / (n - 1)` has a beta distribution
    /// with the parameters `k / 2` and `(n - k - 1) / 2`. All distances are equal where there are as many
    /// modes as `n` shapes can have; then the p-value is 1.
    ///
    /// Source for equal weights: R. Gnanadesikan and J. R. Kettenring, *Robust estimates, residuals, and outlier
    /// detection with multiresponse data*, Biometrics 28 (1972).
    #[must_use]
    pub fn of_training(self, weight: f64, others: SampleSize) -> Self {
        let square = self.distance * self.distance;
        let left = 1.0 - weight - weight * square;
        // At most zero by rounding, for the largest distance that there is.
        let from_others = if left > 0.0 {
            square / left
        } else {
            f64::INFINITY
        };
        Self {
            p_value: survival(from_others, self.degrees_of_freedom, others),
            ..self
        }
    }
}

/// The probability that the squared distance of a new shape is at least `square`. The variances are those with
/// `1/n`, so that Hotelling's `T^2` of a prediction is `square (n - 1) / (n + 1)`.
///
/// Source: T. W. Anderson, *An introduction to multivariate statistical analysis*, chapter 5.
fn survival(square: f64, degrees_of_freedom: usize, sample: SampleSize) -> f64 {
    let k = degrees_of_freedom as f64;
    let (n, of_variance) = (sample.effective, sample.degrees_of_freedom);
    let left = of_variance - k + 1.0;
    if degrees_of_freedom == 0 || left <= 0.0 || square <= 0.0 {
        return 1.0;
    }
    if !square.is_finite() {
        return if square.is_nan() { f64::NAN } else { 0.0 };
    }
    // `1 - x` of the incomplete beta function of the F distribution, without the ratio `F` itself.
    let ratio = (n - 1.0) / (n + 1.0) * square / of_variance;
    beta_reg(0.5 * left, 0.5 * k, 1.0 / (1.0 + ratio))
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
            let sample = SampleSize::equal((k + others) as usize);
            let found = survival(square, k as usize, sample);
            assert!((found / p - 1.0).abs() < 1e-3, "{k}, {others}: {found}");
        }
        // Many training shapes: the chi-squared distribution, for two degrees exp(-x/2).
        let found = survival(3.0, 2, SampleSize::equal(1_000_000));
        assert!((found / (-1.5f64).exp() - 1.0).abs() < 1e-5);
        assert_eq!(survival(0.0, 3, SampleSize::equal(8)), 1.0);
        assert_eq!(survival(f64::INFINITY, 3, SampleSize::equal(8)), 0.0);
        assert!(survival(f64::NAN, 3, SampleSize::equal(8)).is_nan());
        assert_eq!(survival(9.0, 3, SampleSize::equal(3)), 1.0);
    }

    /// Checks that p-values below `p` are a share `p` of all cases, up to an error of the law, for the score of the
    /// first of training shapes with these weights or of a new one of their population.
    fn check_uniform(seed: u64, is_new: bool, weights: &[f64], error: f64) {
        let mut random = SplitMix64::new(seed);
        let mut normal = || normal(random.open_uniform(), random.uniform());
        let cases = 20_000;
        let mut small = [0usize; 2];
        for _ in 0..cases {
            let training: Vec<f64> = weights.iter().map(|_| normal()).collect();
            let pairs = || training.iter().zip(weights);
            let mean: f64 = pairs().map(|(x, w)| w * x).sum();
            let variance: f64 = pairs().map(|(x, w)| w * (x - mean).powi(2)).sum();
            let shape = if is_new { normal() } else { training[0] };
            let score = (shape - mean) / variance.sqrt();
            let sample = SampleSize::of_weights(weights);
            let found = Mahalanobis::new(&[score], &[variance], sample);
            let p = if is_new {
                found.p_value
            } else {
                let others = SampleSize::without(weights, 0);
                found.of_training(weights[0], others).p_value
            };
            small[0] += usize::from(p < 0.05);
            small[1] += usize::from(p < 0.2);
        }
        // Four standard deviations of a share among so many cases: .006 and .011. By the law of the others, three
        // training shapes have no p-value below .05.
        let [least, less] = small.map(|count| count as f64 / f64::from(cases));
        assert!((least - 0.05).abs() < 0.008 + error, "{weights:?}: {least}");
        assert!((less - 0.2).abs() < 0.012 + error, "{weights:?}: {less}");
    }

    #[test]
    fn p_values_of_new_shapes_are_uniform() {
        for n in [3, 8, 20] {
            check_uniform(7, true, &vec![1.0 / f64::from(n); n as usize], 0.0);
        }
    }

    #[test]
    fn p_values_of_training_shapes_are_uniform() {
        for n in [3, 8, 20] {
            check_uniform(11, false, &vec![1.0 / f64::from(n); n as usize], 0.0);
        }
        // As many modes as shapes can have, and none.
        let sample = SampleSize::equal;
        let all = Mahalanobis::new(&[1.0, 1.0], &[1.0, 1.0], sample(3));
        assert_eq!(all.of_training(1.0 / 3.0, sample(2)).p_value, 1.0);
        let none = Mahalanobis::new(&[], &[], sample(3));
        assert_eq!(none.of_training(1.0 / 3.0, sample(2)).p_value, 1.0);
    }

    /// A light shape, one of no weight and a heavy one beside others of equal weight, for which the law is exact; and
    /// a light one beside others of different weights, for which it is not. With equal weights in its place a fifth of
    /// the light ones have p-values below .05.
    #[test]
    fn p_values_of_weighted_shapes_are_uniform() {
        for (first, error) in [(0.001, 0.0), (0.0, 0.0), (0.4, 0.0)] {
            let mut weights = vec![(1.0 - first) / 9.0; 10];
            weights[0] = first;
            check_uniform(13, false, &weights, error);
        }
        let weights = [0.01, 0.19, 0.1, 0.1, 0.1, 0.1, 0.1, 0.05, 0.05, 0.2];
        check_uniform(17, false, &weights, 0.01);
        check_uniform(19, true, &weights, 0.01);
        // Of this one 24 % were below .05 by the law of equal weights, and none by that of the effective number.
        let heavy: Vec<f64> = [0.4].into_iter().chain([0.6 / 9.0; 9]).collect();
        check_uniform(23, true, &heavy, 0.02);
    }

    #[test]
    fn one_standard_deviation_is_one_and_negligible_modes_do_not_count() {
        let variances = [9.0, 0.95, 0.05];
        let along = |scores: &[f64]| Mahalanobis::new(scores, &variances, SampleSize::equal(4));
        assert_eq!(along(&[1.0, 0.0, 0.0]).distance, 1.0);
        assert_eq!(along(&[3.0, 4.0, 0.0]).distance, 5.0);
        let noisy = along(&[3.0, 4.0, 12.0]);
        assert_eq!((noisy.distance, noisy.degrees_of_freedom), (5.0, 2));
        assert_eq!(noisy.over_n, 6.5);
        // The first modes alone.
        assert_eq!(along(&[2.0]).degrees_of_freedom, 1);
    }
}
