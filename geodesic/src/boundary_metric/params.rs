//! Parameters of the metric.

use crate::error::GeodesicError;
use hyperelastic::LameModuli;
use serde::{Deserialize, Serialize};

/// Parameters of the metric at a shape, dimensionless: the box has side one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(deny_unknown_fields, default)]
pub struct MetricParams {
    /// Lamé parameters of the fluid.
    #[serde(flatten)]
    #[cfg_attr(feature = "clap", command(flatten))]
    pub moduli: LameModuli,
    /// Stiffness of the void, relative to the object, above 0 to 1; it makes the velocity there unique.
    #[cfg_attr(feature = "clap", arg(long))]
    pub void_stiffness: f64,
    /// Penalty of the condition at the boundary, in units of `(lambda + 2 mu) / h`.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub penalty: f64,
    /// Largest residual of the condition at the boundary, relative to the variation, at which the
    /// multipliers have converged.
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE"))]
    pub tolerance: f64,
    /// Maximum number of updates of the multipliers.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub max_iterations: usize,
}

impl Default for MetricParams {
    fn default() -> Self {
        Self {
            moduli: LameModuli::default(),
            void_stiffness: 1e-3,
            penalty: 10.0,
            tolerance: 3e-4,
            max_iterations: 30,
        }
    }
}

impl MetricParams {
    /// Checks all parameters.
    ///
    /// # Errors
    /// [`GeodesicError::Parameter`].
    pub fn check(&self) -> Result<(), GeodesicError> {
        let within = |name, value: f64, [least, most]: [f64; 2], expected| {
            if (least..=most).contains(&value) {
                Ok(())
            } else {
                Err(GeodesicError::Parameter {
                    name,
                    expected,
                    value,
                })
            }
        };
        let LameModuli { lambda, mu } = self.moduli;
        within("lambda", lambda, [0.0, 1e12], "from 0 to 1e12")?;
        within("mu", mu, [1e-12, 1e12], "from 1e-12 to 1e12")?;
        let stiffness = self.void_stiffness;
        within("void_stiffness", stiffness, [1e-8, 1.0], "from 1e-8 to 1")?;
        within("penalty", self.penalty, [1e-2, 1e4], "from 0.01 to 10000")?;
        within(
            "tolerance",
            self.tolerance,
            [1e-10, 0.5],
            "from 1e-10 to 0.5",
        )?;
        let iterations = self.max_iterations as f64;
        within("max_iterations", iterations, [1.0, 1e4], "from 1 to 10000")
    }
}
