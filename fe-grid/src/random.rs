//! Reproducible random numbers, the same on every platform.

/// The generator SplitMix64.
///
/// Source: Steele, Lea and Flood, *Fast Splittable Pseudorandom Number Generators* (2014).
#[derive(Clone, Copy, Debug)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// Creates the sequence of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns the next 64 bits.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns the next uniform number in `[0, 1)`, a multiple of `2^-53`.
    pub fn uniform(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns the next uniform number in `(0, 1)`, an odd multiple of `2^-54`.
    pub fn open_uniform(&mut self) -> f64 {
        ((self.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// Returns the next uniform number in `[low, high)`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
}

/// Returns `n` uniform numbers in `[-1, 1)`.
pub fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut random = SplitMix64::new(seed);
    (0..n).map(|_| random.between(-1.0, 1.0)).collect()
}

/// Returns a number of the standard normal distribution from two uniform numbers, `u` in `(0, 1]`.
///
/// Source: Box and Muller, *A Note on the Generation of Random Normal Deviates* (1958).
pub fn normal(u: f64, v: f64) -> f64 {
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_published_generator() {
        assert_eq!(SplitMix64::new(0).next_u64(), 0xe220_a839_7b1d_cdaf);
    }

    #[test]
    fn normal_numbers_have_the_moments_of_their_distribution() {
        let mut random = SplitMix64::new(1);
        let n = 100_000;
        let mut next = |_| normal(random.open_uniform(), random.open_uniform());
        let sample: Vec<f64> = (0..n).map(&mut next).collect();
        let moment = |k: i32| sample.iter().map(|x| x.powi(k)).sum::<f64>() / f64::from(n);
        // Four standard errors of the mean, the variance and the kurtosis.
        assert!(moment(1).abs() < 0.013);
        assert!((moment(2) - 1.0).abs() < 0.018);
        assert!((moment(4) - 3.0).abs() < 0.13);
    }
}
