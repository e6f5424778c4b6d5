//! Tests of the scores in every mode, and in all of them.

use super::analysis_of_variance::{between, check_within, f_ratio, total};
use super::labels::{GroupError, Groups};
use super::relabelling::{Relabelling, n_relabellings};
use serde::Serialize;

/// Whether the modes of shapes differ between groups.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScoreTests {
    /// The ratio `F` of the mean squares between and within the groups in every mode.
    pub f: Vec<f64>,
    /// Its p-value in every mode, regarded by itself.
    pub p_value: Vec<f64>,
    /// The p-value of every mode with control of the family-wise error: the probability that the largest
    /// `F` of all modes is at least that of the mode.
    pub p_value_family_wise: Vec<f64>,
    /// The share of the variance of all modes that lies between the groups.
    pub explained: f64,
    /// The ratio `F` of all modes together, `sum_j B_j / (g - 1) / (sum_j W_j / (n - g))`.
    pub f_overall: f64,
    /// Its p-value: the probability of it if the groups do not differ.
    pub p_value_overall: f64,
    /// The least p-value that relabellings of groups of these sizes can have.
    pub least_p_value: f64,
}

/// Tests whether the coordinates of shapes in their modes, a row for every shape, differ between groups.
///
/// Coordinates are scores times the standard deviations of their modes, so that a mode counts in the test of
/// all modes by its variance. Scores themselves are not suitable there: in all `n - 1` modes of `n` shapes the
/// share between groups is the same for every labelling.
///
/// # Errors
/// [`GroupError::Count`] and [`GroupError::NotFinite`] for an unsuitable table, and [`GroupError::EqualWithin`].
pub fn compare_scores(
    coordinates: &[Vec<f64>],
    groups: &Groups,
    relabelling: Relabelling,
) -> Result<ScoreTests, GroupError> {
    groups.check_rows(coordinates)?;
    let modes = coordinates.first().map_or(0, Vec::len);
    let (n, sizes) = (groups.n_shapes(), groups.sizes());
    let columns: Vec<Vec<f64>> = (0..modes)
        .map(|j| coordinates.iter().map(|row| row[j]).collect())
        .collect();
    let totals: Vec<f64> = columns.iter().map(|column| total(column)).collect();
    let all: f64 = totals.iter().sum();
    let squares = |labels: &[usize]| -> Vec<f64> {
        let columns = columns.iter();
        columns
            .map(|column| between(column, labels, sizes))
            .collect()
    };
    let ratios = |labels: &[usize]| -> Vec<f64> {
        let pairs = squares(labels).into_iter().zip(&totals);
        pairs.map(|(b, t)| f_ratio(b, *t, n, sizes.len())).collect()
    };
    // The sum of squares of all modes is a test of its own, not one of the family.
    let p = relabelling.p_values(groups.labels(), &ratios);
    let overall = |labels: &[usize]| vec![squares(labels).iter().sum::<f64>()];
    let p_overall = relabelling.p_values(groups.labels(), &overall);
    let own = overall(groups.labels())[0];
    check_within(own, all)?;
    Ok(ScoreTests {
        f: ratios(groups.labels()),
        p_value: p.single,
        p_value_family_wise: p.largest,
        explained: if all > 0.0 { own / all } else { 0.0 },
        f_overall: f_ratio(own, all, n, sizes.len()),
        p_value_overall: p_overall.single[0],
        least_p_value: least_p_value(sizes, relabelling),
    })
}

/// The least p-value that a test with these groups can give: exchanging the names of groups of equal
/// sizes does not change a statistic.
pub(super) fn least_p_value(sizes: &[usize], relabelling: Relabelling) -> f64 {
    let mut sorted = sizes.to_vec();
    sorted.sort_unstable();
    let mut equal = 1.0;
    let mut run = 1.0;
    for pair in sorted.windows(2) {
        run = if pair[0] == pair[1] { run + 1.0 } else { 1.0 };
        equal *= run;
    }
    let drawn = 1.0 / (relabelling.permutations + 1) as f64;
    f64::max(equal / n_relabellings(sizes), drawn)
}
