//! Parameters of a geodesic.

use crate::error::GeodesicError;
use hyperelastic::LawSpec;
use serde::{Deserialize, Serialize};

/// Representation of a path: the unknowns in which it is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// Deformations of the start shape at all times: fast; all shapes have its topology.
    #[default]
    Lagrangian,
    /// A level set per shape and deformations between successive shapes: shapes may merge, split
    /// and close their holes.
    LevelSets,
}

/// The shape on whose domain a path of one domain is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum DomainChoice {
    /// The better end, as for `ends`. Where that path does not arrive, or tears and joins parts that both ends have, also
    /// a shape between both.
    #[default]
    Better,
    /// The end on which the path reaches the other end on coarse grids, or else has less energy; if a
    /// part of one shape is hidden, the other.
    Ends,
    /// The start shape.
    Start,
    /// The end shape.
    End,
    /// A shape between both, all of whose deformations are unknown.
    Middle,
}

impl DomainChoice {
    /// Returns whether the better end is looked for.
    pub(crate) fn is_free(self) -> bool {
        matches!(self, Self::Better | Self::Ends)
    }
}

/// Parameters of a geodesic, dimensionless: the box has side one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(deny_unknown_fields, default)]
pub struct GeodesicParams {
    /// Representation of the path: deformations of the start shape (lagrangian) or level sets.
    #[cfg_attr(feature = "clap", arg(long, value_enum))]
    pub form: Form,
    /// Shape on whose domain the path is computed; for the deformations of a start shape only.
    ///
    /// The path is the same in the limit of fine grids; a grid resolves it better on the domain of
    /// the more intricate shape.
    #[cfg_attr(feature = "clap", arg(long, value_enum, hide_short_help = true))]
    pub domain: DomainChoice,
    /// Number of time steps K of the path.
    #[cfg_attr(feature = "clap", arg(short = 'K', long, value_name = "K"))]
    pub steps: usize,
    /// Stored energy density with its Lamé parameters; its second derivative at the identity is the
    /// dissipation of the fluid.
    #[serde(flatten)]
    #[cfg_attr(feature = "clap", command(flatten))]
    pub law: LawSpec,
    /// Weight of the mismatch with the end shape, or between successive shapes for level sets.
    ///
    /// It refers to a path of dissipation `K sum W_k`: it is the weight of the single mismatch of a
    /// path of one start domain, and each mismatch between level sets has K times this weight, so
    /// that the total lag of the boundary along the path does not grow with K.
    #[cfg_attr(feature = "clap", arg(long))]
    pub mismatch_weight: f64,
    /// Fraction of the mismatch that is measured on the end domain, between 0 and 1; paths of one
    /// domain only.
    ///
    /// With 0, limbs of the end shape stay empty where the void is stretched over them, since the
    /// mismatch on the start domain does not see them. With 1, nothing attracts boundaries over a
    /// distance, and coarse grids lead to longer paths.
    #[cfg_attr(
        feature = "clap",
        arg(long, value_name = "SHARE", hide_short_help = true)
    )]
    pub deformed_share: f64,
    /// Weight of the boundary area of the shapes along the path; level sets only.
    #[cfg_attr(feature = "clap", arg(long))]
    pub area_weight: f64,
    /// Regularisation of the area where the level set is flat; level sets only.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub area_regularisation: f64,
    /// Stiffness of the void under the elastic law, relative to the object, from 0 to 1; 0 allows
    /// the void to fold.
    #[cfg_attr(feature = "clap", arg(long))]
    pub void_stiffness: f64,
    /// Viscosity of the void without a barrier against folding, relative to the shear modulus of the
    /// object, from 0 to 1; positive where the void stiffness is 0.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub void_viscosity: f64,
    /// Width of the smoothed step function of the mismatch on every level, in grid spacings.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub mismatch_cells: f64,
    /// Half-width of the elastic indicator on every level, in grid spacings.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub indicator_cells: f64,
    /// Number of nodes along the longest side of the grid on which the first path of level sets is
    /// computed.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", hide_short_help = true))]
    pub flow_nodes: usize,
    /// Number of nodes along the longest side of the coarsest grid.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", hide_short_help = true))]
    pub coarsest_nodes: usize,
    /// Stopping tolerance of a level: relative decrease of the energy over five iterations.
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE"))]
    pub tolerance: f64,
    /// Maximum number of iterations per level [default: 500 for deformations of a start shape, 100
    /// for level sets].
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_iterations: Option<usize>,
    /// Lower bound of the Jacobian determinant of every accepted deformation on the cells of the
    /// object; at most 0.9.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub min_determinant: f64,
}

impl Default for GeodesicParams {
    fn default() -> Self {
        Self {
            form: Form::default(),
            domain: DomainChoice::default(),
            steps: 8,
            law: LawSpec::default(),
            mismatch_weight: 100.0,
            deformed_share: 0.5,
            area_weight: 1e-3,
            area_regularisation: 1e-3,
            void_stiffness: 1e-4,
            void_viscosity: 0.0,
            mismatch_cells: 1.0,
            indicator_cells: 2.0,
            flow_nodes: 33,
            coarsest_nodes: 17,
            tolerance: 1e-4,
            max_iterations: None,
            min_determinant: 1e-3,
        }
    }
}

impl GeodesicParams {
    /// Returns the weight of one mismatch.
    pub fn resolved_mismatch_weight(&self) -> f64 {
        match self.form {
            Form::Lagrangian => self.mismatch_weight,
            Form::LevelSets => self.steps as f64 * self.mismatch_weight,
        }
    }

    /// Returns the maximum number of iterations per level.
    pub fn resolved_max_iterations(&self) -> usize {
        self.max_iterations.unwrap_or(match self.form {
            Form::Lagrangian => 500,
            Form::LevelSets => 100,
        })
    }

    /// Returns the parameters for the inverse deformations, as of paths that are computed on the domain of their
    /// end; the same where the law has no inverse model.
    #[must_use]
    pub fn inverted(&self) -> Self {
        let law = self.law.law.inverted().unwrap_or(self.law.law);
        Self {
            law: LawSpec { law, ..self.law },
            ..self.clone()
        }
    }

    /// Checks all parameters.
    ///
    /// # Errors
    /// [`GeodesicError::Parameter`] with the value found.
    pub fn check(&self) -> Result<(), GeodesicError> {
        let bad = |name, expected, value| {
            Err(GeodesicError::Parameter {
                name,
                expected,
                value,
            })
        };
        if self.steps == 0 {
            return bad("steps", "at least 1", 0.0);
        }
        for (name, value) in [
            ("mismatch_weight", self.mismatch_weight),
            ("area_weight", self.area_weight),
            ("area_regularisation", self.area_regularisation),
            ("mismatch_cells", self.mismatch_cells),
            ("indicator_cells", self.indicator_cells),
            ("tolerance", self.tolerance),
            ("min_determinant", self.min_determinant),
        ] {
            if !(1e-18..=1e12).contains(&value) {
                return bad(name, "a positive number from 1e-18 to 1e12", value);
            }
        }
        for (name, value) in [
            ("mismatch_cells", self.mismatch_cells),
            ("indicator_cells", self.indicator_cells),
        ] {
            if value > 1e3 {
                return bad(name, "at most 1000", value);
            }
        }
        // Larger ones stop before the first iteration.
        if self.tolerance > 0.5 {
            return bad("tolerance", "at most 0.5", self.tolerance);
        }
        for (name, value) in [
            ("deformed_share", self.deformed_share),
            ("void_stiffness", self.void_stiffness),
            ("void_viscosity", self.void_viscosity),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return bad(name, "between 0 and 1", value);
            }
        }
        if self.void_stiffness + self.void_viscosity <= 0.0 {
            return bad("void_viscosity", "positive where void_stiffness is 0", 0.0);
        }
        if self.min_determinant > 0.9 {
            return bad("min_determinant", "at most 0.9", self.min_determinant);
        }
        Ok(())
    }
}
