//! Confidence ellipses of means.

/// An ellipse: its centre, and its half axes as vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// The centre.
    pub centre: [f64; 2],
    /// The half axes, the longer one first.
    pub half_axes: [[f64; 2]; 2],
}

/// Computes the ellipse that contains the mean of the distribution of `n` points with this probability, if
/// they are normally distributed: `n (m - x)^T S^-1 (m - x) <= 2 (n - 1) / (n - 2) F`, with the sample's mean
/// `m` and covariance `S` and the quantile `F` of the F distribution with 2 and `n - 2` degrees of freedom, which
/// is `(n - 2)/2 ((1 - level)^(-2/(n - 2)) - 1)`. `None` for fewer than four points, and for points on a line.
///
/// Source: H. Hotelling, *The generalization of Student's ratio*, Ann. Math. Statist. 2 (1931).
///
/// # Panics
/// If the probability is not below 1 or is negative.
pub fn mean_ellipse(points: &[[f64; 2]], level: f64) -> Option<Ellipse> {
    assert!((0.0..1.0).contains(&level), "a probability below one");
    if points.len() < 4 {
        return None;
    }
    let n = points.len() as f64;
    let mean: [f64; 2] = std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let covariance = |i: usize, j: usize| {
        let products = points.iter().map(|p| (p[i] - mean[i]) * (p[j] - mean[j]));
        products.sum::<f64>() / (n - 1.0)
    };
    let (a, b, c) = (covariance(0, 0), covariance(0, 1), covariance(1, 1));
    let (middle, half) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
    let eigenvalues = [middle + half, middle - half];
    // Rounding leaves something of the variance across a line.
    let flat = eigenvalues[1] <= 1e-12 * eigenvalues[0];
    if flat || !eigenvalues[1].is_finite() {
        return None;
    }
    let angle = 0.5 * (2.0 * b).atan2(a - c);
    let (sin, cos) = angle.sin_cos();
    let threshold = (n - 1.0) / n * ((1.0 - level).powf(-2.0 / (n - 2.0)) - 1.0);
    let [long, short] = eigenvalues.map(|eigenvalue| (threshold * eigenvalue).sqrt());
    Some(Ellipse {
        centre: mean,
        half_axes: [[long * cos, long * sin], [-short * sin, short * cos]],
    })
}

impl Ellipse {
    /// Points on it, at equal angles.
    pub fn points(&self, count: usize) -> Vec<[f64; 2]> {
        let [p, q] = self.half_axes;
        let at = |i: usize| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
            std::array::from_fn(|k| self.centre[k] + cos * p[k] + sin * q[k])
        };
        (0..count).map(at).collect()
    }

    /// Whether a point lies in it.
    pub fn contains(&self, point: [f64; 2]) -> bool {
        let along = |axis: [f64; 2]| {
            let product = (0..2).map(|k| axis[k] * (point[k] - self.centre[k]));
            product.sum::<f64>() / (axis[0] * axis[0] + axis[1] * axis[1])
        };
        self.half_axes
            .iter()
            .map(|axis| along(*axis).powi(2))
            .sum::<f64>()
            <= 1.0
    }
}
