//! Tests at every point of the boundary.

use super::analysis_of_variance::{f_ratio, total};
use super::labels::{GroupError, Groups};
use super::relabelling::Relabelling;
use serde::Serialize;

/// Where groups differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PointTests {
    /// The ratio `F` of the mean squares between and within the groups at every point.
    pub f: Vec<f64>,
    /// The p-value at every point, regarded by itself.
    pub p_value: Vec<f64>,
    /// The false discovery rate: if the points up to this value are called different, the expected share of
    /// wrong ones among them is at most this.
    pub false_discovery_rate: Vec<f64>,
    /// The p-values with control of the family-wise error: that the largest `F` of all points is as large.
    pub p_value_family_wise: Vec<f64>,
}

/// Tests whether a quantity differs between groups at points; `values` has a row for every shape with a
/// number for every point.
///
/// # Errors
/// [`GroupError::Count`] and [`GroupError::NotFinite`] for an unsuitable table.
pub fn compare_points(
    values: &[Vec<f64>],
    groups: &Groups,
    relabelling: Relabelling,
) -> Result<PointTests, GroupError> {
    groups.check_rows(values)?;
    let points = values.first().map_or(0, Vec::len);
    let (n, sizes) = (groups.n_shapes(), groups.sizes());
    let mut means = vec![0.0; points];
    for row in values {
        for (mean, x) in means.iter_mut().zip(row) {
            *mean += x / n as f64;
        }
    }
    let totals: Vec<f64> = (0..points)
        .map(|q| total(&values.iter().map(|row| row[q]).collect::<Vec<_>>()))
        .collect();
    // Rows are added as a whole: far faster than the points one by one.
    let ratios = |labels: &[usize]| -> Vec<f64> {
        let mut squares = vec![0.0; points];
        let mut sums = vec![0.0; points];
        for (group, &size) in sizes.iter().enumerate() {
            sums.fill(0.0);
            for (row, _) in values.iter().zip(labels).filter(|(_, l)| **l == group) {
                for ((sum, x), mean) in sums.iter_mut().zip(row).zip(&means) {
                    *sum += x - mean;
                }
            }
            for (square, sum) in squares.iter_mut().zip(&sums) {
                *square += sum * sum / size as f64;
            }
        }
        let pairs = squares.iter().zip(&totals);
        pairs
            .map(|(&b, &t)| f_ratio(b, t, n, sizes.len()))
            .collect()
    };
    let p = relabelling.p_values(groups.labels(), &ratios);
    Ok(PointTests {
        f: ratios(groups.labels()),
        false_discovery_rate: false_discovery_rates(&p.single),
        p_value: p.single,
        p_value_family_wise: p.largest,
    })
}

/// Computes for every p-value the least false discovery rate at which it counts as a discovery:
/// `min_{k >= r} n p_(k) / k` for the one of rank `r`, at most 1.
///
/// Source: Benjamini and Hochberg, *Controlling the false discovery rate* (1995).
pub fn false_discovery_rates(p_values: &[f64]) -> Vec<f64> {
    let n = p_values.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| p_values[i].total_cmp(&p_values[j]));
    let mut rates = vec![1.0; n];
    let mut least: f64 = 1.0;
    for (rank, &i) in order.iter().enumerate().rev() {
        least = least.min(n as f64 * p_values[i] / (rank + 1) as f64);
        rates[i] = least;
    }
    rates
}
