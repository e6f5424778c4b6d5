//! Reproducible random numbers.

/// A sequence of standard normal numbers: SplitMix64 (Steele, Lea and Flood 2014) and the
/// Box-Muller transform.
pub(crate) struct Normal {
    state: u64,
}

impl Normal {
    /// Creates the sequence of a seed.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Returns a uniform number in `(0, 1)`.
    fn uniform(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        ((z >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// Returns the next number.
    pub fn next(&mut self) -> f64 {
        let (u, v) = (self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_normal() {
        let mut normal = Normal::new(1);
        let n = 100_000;
        let sample: Vec<f64> = (0..n).map(|_| normal.next()).collect();
        let moment = |k: i32| sample.iter().map(|x| x.powi(k)).sum::<f64>() / f64::from(n);
        // Four standard errors of the mean, the variance and the kurtosis.
        assert!(moment(1).abs() < 0.013);
        assert!((moment(2) - 1.0).abs() < 0.018);
        assert!((moment(4) - 3.0).abs() < 0.13);
    }
}
