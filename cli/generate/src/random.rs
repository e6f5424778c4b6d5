//! Random numbers.

use fe_grid::random::{SplitMix64, normal};

/// Platform-independent random numbers.
#[derive(Clone, Debug)]
pub(crate) struct Random(SplitMix64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// The next number in `[0, 1)`.
    pub fn uniform(&mut self) -> f64 {
        self.0.uniform()
    }

    /// A number of the standard normal distribution.
    pub fn normal(&mut self) -> f64 {
        // A logarithm of zero is avoided: `1 - u` lies in `(0, 1]`.
        normal(1.0 - self.uniform(), self.uniform())
    }

    /// The next number in `[low, high)`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.between(low, high)
    }
}
