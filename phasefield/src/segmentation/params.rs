//! Parameters of a segmentation.

use crate::error::PhaseFieldError;
use crate::profile::positive;
use serde::{Deserialize, Serialize};

/// The weights of the three terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weights {
    /// `alpha`, of the difference to the image.
    pub fidelity: f64,
    /// `beta`, of the gradient away from the edges.
    pub smoothness: f64,
    /// `nu`, of the length of the edges.
    pub edges: f64,
}

impl Default for Weights {
    /// The weights for a length of .02, a contrast of .2 and `nu = 1`.
    fn default() -> Self {
        Self {
            fidelity: 2500.0,
            smoothness: 1.0,
            edges: 1.0,
        }
    }
}

impl Weights {
    fn are_default(&self) -> bool {
        *self == Self::default()
    }

    /// Computes the weights for which a jump of height `contrast` is the smallest that becomes an
    /// edge, in the limit of a thin interface, and the image is smooth over `length` elsewhere:
    ///
    /// ```text
    /// beta = 2 nu length / contrast^2,    alpha = 2 nu / (length contrast^2).
    /// ```
    ///
    /// # Errors
    /// [`PhaseFieldError::Parameter`] if a number is not positive and finite.
    pub fn for_scales(edges: f64, length: f64, contrast: f64) -> Result<Self, PhaseFieldError> {
        let edges = positive("edges", edges)?;
        let length = positive("length", length)?;
        let share = 2.0 * edges / positive("contrast", contrast)?.powi(2);
        Ok(Self {
            fidelity: share / length,
            smoothness: share * length,
            edges,
        })
    }

    /// Returns all weights multiplied by a factor.
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            fidelity: factor * self.fidelity,
            smoothness: factor * self.smoothness,
            edges: factor * self.edges,
        }
    }
}

/// Parameters of a segmentation. Lengths are those of the grid's coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(deny_unknown_fields, default)]
pub struct SegmentationParams {
    /// `alpha`, `beta` and `nu`. By default those of [`Weights::for_scales`] for a length of .02,
    /// a contrast of .2 and `nu = 1`: images with values from 0 to 1, and boxes of side one.
    /// They are written only where they are not these.
    #[serde(skip_serializing_if = "Weights::are_default")]
    #[cfg_attr(feature = "clap", arg(skip))]
    pub weights: Weights,
    /// Interface width eps of the phase field on every level, in grid spacings.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub interface_cells: f64,
    /// Residual conductance k of an edge, relative to eps^2. It keeps the energy coercive.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub edge_conductance: f64,
    /// Stopping tolerance of a level: relative decrease of the energy by one solution of both
    /// linear systems.
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE"))]
    pub tolerance: f64,
    /// Maximum number of alternations between the two linear systems per level.
    #[cfg_attr(
        feature = "clap",
        arg(long, value_name = "N", alias = "max-alternations")
    )]
    pub max_iterations: usize,
    /// Number of nodes along the longest side of the coarsest grid.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", hide_short_help = true))]
    pub coarsest_nodes: usize,
}

impl Default for SegmentationParams {
    fn default() -> Self {
        Self {
            weights: Weights::default(),
            interface_cells: 2.0,
            edge_conductance: 1.0,
            tolerance: 1e-5,
            max_iterations: 200,
            coarsest_nodes: 17,
        }
    }
}

impl SegmentationParams {
    /// Checks all parameters.
    ///
    /// # Errors
    /// [`PhaseFieldError::Parameter`].
    pub fn check(&self) -> Result<(), PhaseFieldError> {
        positive("fidelity", self.weights.fidelity)?;
        positive("smoothness", self.weights.smoothness)?;
        positive("edges", self.weights.edges)?;
        positive("interface_cells", self.interface_cells)?;
        positive("edge_conductance", self.edge_conductance)?;
        positive("tolerance", self.tolerance)?;
        for (name, expected, value, largest) in [
            ("tolerance", "at most 0.5", self.tolerance, 0.5),
            ("interface_cells", "at most 1000", self.interface_cells, 1e3),
            (
                "edge_conductance",
                "at most 1e6",
                self.edge_conductance,
                1e6,
            ),
        ] {
            if value > largest {
                return Err(PhaseFieldError::Parameter {
                    name,
                    expected,
                    value,
                });
            }
        }
        Ok(())
    }
}
