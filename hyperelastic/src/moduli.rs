//! The two constants of an isotropic linear response.

use crate::error::LawError;
use serde::{Deserialize, Serialize};

/// Lamé parameters: `diss[v] = lambda/2 (tr e)^2 + mu tr(e^2)`, `e = sym Dv`.
///
/// Energies are dimensionless, so both are plain numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(deny_unknown_fields)]
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
    /// [`LawError::Moduli`] unless both are finite, `lambda >= 0` and `mu > 0`.
    pub fn new(lambda: f64, mu: f64) -> Result<Self, LawError> {
        Self { lambda, mu }.checked()
    }

    /// Returns the moduli if they are admissible.
    ///
    /// # Errors
    /// As [`LameModuli::new`].
    pub fn checked(self) -> Result<Self, LawError> {
        let usable =
            self.lambda.is_finite() && self.mu.is_finite() && self.lambda >= 0.0 && self.mu > 0.0;
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
