//! Reproducible random numbers.

use fe_grid::random::{SplitMix64, normal};

/// A sequence of standard normal numbers.
pub(crate) struct Normal(SplitMix64);

impl Normal {
    /// Creates the sequence of a seed.
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// Returns the next number.
    pub fn next(&mut self) -> f64 {
        normal(self.0.open_uniform(), self.0.open_uniform())
    }
}
