//! Sums of squares between and within groups.

use super::labels::GroupError;

/// The sum of squares between groups of one number a shape, `sum_g n_g (mean_g - mean)^2`.
pub(super) fn between(values: &[f64], labels: &[usize], sizes: &[usize]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let mut sums = vec![0.0; sizes.len()];
    for (x, &label) in values.iter().zip(labels) {
        sums[label] += x - mean;
    }
    let pairs = sums.iter().zip(sizes);
    pairs.map(|(sum, &size)| sum * sum / size as f64).sum()
}

/// The sum of squares about the mean.
pub(super) fn total(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|x| (x - mean).powi(2)).sum()
}

/// The ratio `F` of the mean squares between and within the groups; infinite where shapes of a group
/// do not differ but groups do, and 0 where nothing differs.
/// Checks that the shapes of a group differ where those of all groups do; what is left by rounding does not count.
///
/// # Errors
/// [`GroupError::EqualWithin`].
pub(super) fn check_within(between: f64, total: f64) -> Result<(), GroupError> {
    if between > 0.0 && total - between <= 1e-12 * total {
        return Err(GroupError::EqualWithin);
    }
    Ok(())
}

pub(super) fn f_ratio(between: f64, total: f64, n_shapes: usize, n_groups: usize) -> f64 {
    let within = (total - between).max(0.0);
    if between <= 0.0 {
        return 0.0;
    }
    (between / (n_groups - 1) as f64) / (within / (n_shapes - n_groups) as f64)
}
