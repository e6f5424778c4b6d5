//! Parameters of the calculus on deformations.

use crate::error::GeodesicError;
use crate::params::GeodesicParams;
use hyperelastic::LawSpec;
use serde::{Deserialize, Serialize};

/// Parameters of the calculus on deformations of one start shape. What the metric is made of comes
/// from the geodesic that is continued: see [`From<&GeodesicParams>`](CalculusParams::from).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CalculusParams {
    /// Stored energy density with its Lamé parameters.
    #[serde(flatten)]
    pub law: LawSpec,
    /// Stiffness of the void under the law, relative to the object; 0 allows the void to fold.
    pub void_stiffness: f64,
    /// Viscosity of the void, without a barrier.
    pub void_viscosity: f64,
    /// Half-width of the elastic indicator, in grid spacings.
    pub indicator_cells: f64,
    /// Every accepted deformation has a determinant above this on the cells of the object, and,
    /// where the void has a stiffness, on all.
    pub min_determinant: f64,
    /// An equation is solved where the correction that is left is this share of the step.
    pub tolerance: f64,
    /// Most iterations of one equation.
    pub max_iterations: usize,
    /// Earlier iterates that the next one is made of.
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
    /// Checks all values.
    ///
    /// # Errors
    /// [`GeodesicError::Parameter`] with what was found.
    pub fn check(&self) -> Result<(), GeodesicError> {
        // What both have in common is judged in one place.
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
