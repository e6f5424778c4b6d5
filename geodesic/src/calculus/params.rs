//! Parameters of the calculus on deformations.

use crate::error::GeodesicError;
use crate::params::GeodesicParams;
use hyperelastic::LawSpec;
use serde::{Deserialize, Serialize};

/// Parameters of the calculus on deformations of one start shape. Those of the metric are taken
/// from the geodesic that is extended: see [`From<&GeodesicParams>`](CalculusParams::from).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CalculusParams {
    /// Stored energy density with its Lamé parameters.
    #[serde(flatten)]
    pub law: LawSpec,
    /// Stiffness of the void under the law, relative to the object; 0 allows the void to fold.
    pub void_stiffness: f64,
    /// Viscosity of the void, without a barrier, relative to the shear modulus of the object.
    pub void_viscosity: f64,
    /// Half-width of the elastic indicator, in grid spacings.
    pub indicator_cells: f64,
    /// Lower bound of the determinant of every accepted deformation on the cells of the object,
    /// and, if the void has a stiffness, on all cells.
    pub min_determinant: f64,
    /// Relative tolerance: an equation is solved if the remaining correction is at most this
    /// fraction of the step.
    pub tolerance: f64,
    /// Maximal number of iterations per equation.
    pub max_iterations: usize,
    /// Number of previous iterates used by Anderson acceleration.
    pub history: usize,
}

impl Default for CalculusParams {
    fn default() -> Self {
        Self::from(&GeodesicParams::default())
    }
}

impl From<&GeodesicParams> for CalculusParams {
    fn from(geodesic: &GeodesicParams) -> Self {
        Self {
            law: geodesic.law,
            void_stiffness: geodesic.void_stiffness,
            void_viscosity: geodesic.void_viscosity,
            indicator_cells: geodesic.indicator_cells,
            min_determinant: geodesic.min_determinant,
            tolerance: 1e-6,
            max_iterations: 200,
            history: 10,
        }
    }
}

impl CalculusParams {
    /// Checks all parameters.
    ///
    /// # Errors
    /// [`GeodesicError::Parameter`] with the value found.
    pub fn check(&self) -> Result<(), GeodesicError> {
        // Parameters shared with geodesics are checked there.
        GeodesicParams {
            law: self.law,
            void_stiffness: self.void_stiffness,
            void_viscosity: self.void_viscosity,
            indicator_cells: self.indicator_cells,
            min_determinant: self.min_determinant,
            tolerance: self.tolerance,
            ..GeodesicParams::default()
        }
        .check()?;
        if self.max_iterations == 0 {
            return Err(GeodesicError::Parameter {
                name: "max_iterations",
                expected: "at least 1",
                value: 0.0,
            });
        }
        Ok(())
    }
}
