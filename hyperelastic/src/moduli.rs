//! The two constants of an isotropic linear response.

use crate::error::LawError;
use serde::{Deserialize, Serialize};

/// Largest modulus: sums of squares of stresses are finite.
const LARGEST: f64 = 1e12;

/// Lamé parameters: `diss[v] = lambda/2 (tr e)^2 + mu tr(e^2)`, `e = sym Dv`.
///
/// Energies are dimensionless, so both are plain numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(deny_unknown_fields, default)]
pub struct LameModuli {
    /// First Lamé parameter, at least 0.
    #[cfg_attr(feature = "clap", arg(long))]
    pub lambda: f64,
    /// Second Lamé parameter, the shear modulus, above 0.
    #[cfg_attr(feature = "clap", arg(long))]
    pub mu: f64,
}

impl LameModuli {
    /// Creates checked moduli.
    ///
    /// # Errors
    /// [`LawError::Moduli`] unless `0 <= lambda <= 1e12` and `1e-12 <= mu <= 1e12`.
    pub fn new(lambda: f64, mu: f64) -> Result<Self, LawError> {
        Self { lambda, mu }.checked()
    }

    /// Returns the moduli if they are admissible.
    ///
    /// # Errors
    /// As [`LameModuli::new`].
    pub fn checked(self) -> Result<Self, LawError> {
        let usable = (0.0..=LARGEST).contains(&self.lambda)
            && (LARGEST.recip()..=LARGEST).contains(&self.mu);
        if usable {
            Ok(self)
        } else {
            Err(LawError::Moduli {
                lambda: self.lambda,
                mu: self.mu,
            })
        }
    }
}

impl Default for LameModuli {
    /// Both one.
    fn default() -> Self {
        Self {
            lambda: 1.0,
            mu: 1.0,
        }
    }
}
