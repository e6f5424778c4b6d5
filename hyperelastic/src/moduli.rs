//! The two constants of an isotropic linear response.

use crate::LawError;
use serde::{Deserialize, Serialize};

/// Lamé moduli: `diss[v] = bulk_lambda/2 (tr e)^2 + shear_modulus tr(e^2)`, `e = sym Dv`.
///
/// Energies are dimensionless throughout, so both are plain numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LameModuli {
    /// First Lamé modulus, `>= 0`.
    pub bulk_lambda: f64,
    /// Shear modulus, `> 0`.
    pub shear_modulus: f64,
}

impl LameModuli {
    /// Checked moduli.
    ///
    /// # Errors
    /// [`LawError::Moduli`] unless both are finite, `bulk_lambda >= 0` and `shear_modulus > 0`.
    pub fn new(bulk_lambda: f64, shear_modulus: f64) -> Result<Self, LawError> {
        Self {
            bulk_lambda,
            shear_modulus,
        }
        .checked()
    }

    /// Returns the moduli where they are usable.
    ///
    /// # Errors
    /// As [`LameModuli::new`].
    pub fn checked(self) -> Result<Self, LawError> {
        let usable = self.bulk_lambda.is_finite()
            && self.shear_modulus.is_finite()
            && self.bulk_lambda >= 0.0
            && self.shear_modulus > 0.0;
        if usable {
            Ok(self)
        } else {
            Err(LawError::Moduli {
                bulk_lambda: self.bulk_lambda,
                shear_modulus: self.shear_modulus,
            })
        }
    }
}

impl Default for LameModuli {
    /// Both one.
    fn default() -> Self {
        Self {
            bulk_lambda: 1.0,
            shear_modulus: 1.0,
        }
    }
}
