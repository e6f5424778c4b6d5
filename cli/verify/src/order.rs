//! Orders of convergence, and limits by extrapolation.

/// A least-squares line through points on logarithmic axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Its slope: the order of convergence.
    pub slope: f64,
    /// The standard error of the slope; zero for two points, which determine a line.
    pub error: f64,
}

impl Fit {
    /// The line through `(log x, log y)`; `None` for fewer than two points, or for numbers without
    /// a logarithm.
    pub fn of(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len() as f64;
        let usable = |x: f64| x > 0.0 && x.is_finite();
        if points.len() < 2 || !points.iter().all(|&(x, y)| usable(x) && usable(y)) {
            return None;
        }
        let logs: Vec<(f64, f64)> = points.iter().map(|&(x, y)| (x.ln(), y.ln())).collect();
        let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / n;
        let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / n;
        let spread: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
        let joint: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
        if spread <= 0.0 {
            return None;
        }
        let slope = joint / spread;
        let left: f64 = logs
            .iter()
            .map(|p| (p.1 - mean_y - slope * (p.0 - mean_x)).powi(2))
            .sum();
        let error = if points.len() > 2 {
            (left / (n - 2.0) / spread).sqrt()
        } else {
            0.0
        };
        Some(Self { slope, error })
    }
}

/// An extrapolated limit, with its change by the last refinement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// The limit.
    pub value: f64,
    /// Its change by the last refinement.
    pub uncertainty: f64,
}

/// The limit of values for halved steps, of a known order (Richardson).
///
/// # Panics
/// For fewer than three values.
pub fn richardson(values: &[f64], order: f64) -> Limit {
    assert!(values.len() >= 3, "extrapolation needs three values");
    let gain = 2f64.powf(order) - 1.0;
    let at = |i: usize| values[i] + (values[i] - values[i - 1]) / gain;
    let last = values.len() - 1;
    Limit {
        value: at(last),
        uncertainty: (at(last) - at(last - 1)).abs(),
    }
}

/// The observed order of values for halved steps with an unknown limit: the logarithm to base two
/// of the ratios of their differences, as points `(step, difference)` for [`Fit::of`].
pub fn differences(steps: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    steps
        .iter()
        .zip(values.windows(2))
        .map(|(&x, pair)| (x, (pair[1] - pair[0]).abs()))
        .collect()
}
