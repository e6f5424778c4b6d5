//! Growth of times: exponents and factors.

/// Least-squares slope of `ln y` over `ln x`: `p` if `y` grows like `x^p`; `None` for fewer than
/// two points.
pub fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let spread: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
    let joint: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    (spread > 0.0).then(|| joint / spread)
}

/// Ratio of the largest to the smallest `y / x`: 1 if `y` is proportional to `x`.
pub fn spread(points: &[(f64, f64)]) -> Option<f64> {
    let ratios = || points.iter().map(|(x, y)| y / x);
    let least = ratios().reduce(f64::min)?;
    Some(ratios().reduce(f64::max)? / least)
}

/// Largest growth of `y / x` from a point to one with a larger `x`:
/// the maximum of `(y_j / x_j) / (y_i / x_i)` over `x_i < x_j`.
pub fn beyond_linear(points: &[(f64, f64)]) -> Option<f64> {
    let pairs = points
        .iter()
        .flat_map(|a| points.iter().map(move |b| (a, b)));
    let growing = pairs.filter(|(a, b)| a.0 < b.0);
    growing.map(|(a, b)| b.1 / b.0 * a.0 / a.1).reduce(f64::max)
}

/// The median: the middle value, or the mean of the two in the middle; NaN for no values.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    match n {
        0 => f64::NAN,
        _ if n % 2 == 1 => sorted[n / 2],
        _ => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_has_its_exponent() {
        let points = [1.0, 4.0, 16.0, 64.0].map(|x: f64| (x, 3.0 * x.powf(1.25)));
        // Logarithms and sums of four numbers: a few roundings.
        assert!((exponent(&points).unwrap() - 1.25).abs() < 1e-14);
        assert_eq!(exponent(&points[..1]), None);
    }

    #[test]
    fn what_grows_in_proportion_has_no_spread() {
        assert_eq!(spread(&[(1.0, 2.0), (4.0, 8.0)]), Some(1.0));
        assert_eq!(spread(&[(1.0, 2.0), (4.0, 12.0), (2.0, 3.0)]), Some(2.0));
        assert_eq!(spread(&[]), None);
        let points = [(1.0, 2.0), (2.0, 3.0), (4.0, 12.0), (8.0, 8.0)];
        assert_eq!(beyond_linear(&points), Some(2.0));
        assert_eq!(beyond_linear(&[(1.0, 4.0), (2.0, 4.0)]), Some(0.5));
        assert_eq!(beyond_linear(&points[..1]), None);
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
    }
}
