//! Parameters of a joint average.

use crate::error::AverageError;
use crate::params::{AverageParams, BoundaryCondition};
use phasefield::segmentation::SegmentationParams;
use serde::{Deserialize, Serialize};

/// Parameters of segmentation and averaging at the same time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JointParams {
    /// Law, mismatch, length, boundary and the width of the interfaces. The object being the whole
    /// box, the stiffness of a void is not used; nor are the solver and the weights of shapes. By
    /// default the faces of the box stay where they are: what is free to move as a whole drifts
    /// towards them, where a part of its interface is cut off.
    pub average: AverageParams,
    /// The energy of the images: its weights beside those of the average; by default those of
    /// [`SegmentationParams`] twice. What it says of interface
    /// widths and of the coarsest level is not used.
    pub segmentation: SegmentationParams,
    /// Steps of the minimiser of averages in a round.
    pub steps: usize,
    /// A level ends when a round lowers the energy by less than this share of it.
    pub tolerance: f64,
    /// Most rounds on a level.
    pub max_rounds: usize,
}

impl Default for JointParams {
    fn default() -> Self {
        let usual = SegmentationParams::default();
        Self {
            average: AverageParams {
                boundary: BoundaryCondition::Identity,
                ..AverageParams::default()
            },
            segmentation: SegmentationParams {
                weights: usual.weights.scaled(2.0),
                ..usual
            },
            steps: 8,
            tolerance: 1e-3,
            max_rounds: 30,
        }
    }
}

impl JointParams {
    /// Checks all values for `n` images.
    ///
    /// # Errors
    /// Those of [`AverageParams::check`] and of [`SegmentationParams::check`].
    pub fn check(&self, n: usize) -> Result<(), AverageError> {
        self.average.check(n)?;
        self.segmentation.check()?;
        if self.tolerance > 0.0 && self.tolerance.is_finite() {
            return Ok(());
        }
        Err(AverageError::Parameter {
            name: "tolerance",
            expected: "a positive number",
            value: self.tolerance,
        })
    }
}
