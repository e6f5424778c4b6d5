//! Parameters of a joint average.

use crate::error::AverageError;
use crate::params::{AverageParams, BoundaryCondition};
use phasefield::segmentation::SegmentationParams;
use serde::{Deserialize, Serialize};

/// Where the edges of the images come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Edges {
    /// They are found together with the average.
    #[default]
    Together,
    /// Every image is segmented by itself, and its edges are held.
    Separate,
    /// The images are drawings of edges, which are held: 1 on an edge, 0 elsewhere.
    Given,
}

/// Parameters of segmentation and averaging at the same time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JointParams {
    /// Law, mismatch, length, boundary conditions and interface width. The object is the whole box,
    /// so the stiffness of the void is not used; nor are the solver and the weights of the shapes.
    /// By default the faces of the box are fixed: an average that is free to move drifts towards
    /// the faces, where a part of its interface is cut off.
    pub average: AverageParams,
    /// Energy of the images; its weights are relative to those of the average and by default twice
    /// those of [`SegmentationParams`]. Its interface width and coarsest level are not used.
    pub segmentation: SegmentationParams,
    /// Where the edges come from. Those that are held have no terms in the energy.
    pub edges: Edges,
    /// Number of steps of the minimiser of averages per round.
    pub steps: usize,
    /// Relative tolerance: a level ends when a round decreases the energy by less than this
    /// fraction, the finest one also not before the estimate of the remaining energy is less than a hundred times
    /// this fraction of the elastic energy ([`JointEnergy::remaining_share`](super::JointEnergy::remaining_share)).
    pub tolerance: f64,
    /// Maximal number of rounds per level.
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
            edges: Edges::default(),
            steps: 8,
            tolerance: 1e-3,
            max_rounds: 30,
        }
    }
}

impl JointParams {
    /// Checks all parameters for `n` images.
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
