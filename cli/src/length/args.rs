//! Options of `shapespace length`.

use std::path::PathBuf;

use ::geodesic::GeodesicParams;
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::config::{Config, allow};
use crate::error::CliError;
use crate::geodesic::{check_form, check_path};
use crate::options::{MaskOptions, at_least};
use shapespace_input::Kinds;

/// Maximum number of steps of the whole path.
const MOST_STEPS: usize = 256;

/// Configuration of `shapespace length`.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct LengthConfig {
    /// Masks of the shapes along the path, in order, the object bright: PNG, JPEG, PGM, PBM, PPM, TIFF,
    /// BMP, .npy, NIfTI, NRRD or MetaImage; closed surfaces: STL, PLY, OBJ, VTK or VTP; outlines: SVG
    /// or CSV. A folder, or a pattern in quotes, stands for its files in the order of their names.
    #[arg(value_name = "SHAPE")]
    pub inputs: Vec<PathBuf>,
    /// How masks are read, placed and aligned.
    #[serde(flatten)]
    #[command(flatten)]
    pub masks: MaskOptions,
    /// Input in whose world coordinates the results lie, by its path or its file name [default: the
    /// first].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[arg(long, value_name = "INPUT")]
    pub like: Option<PathBuf>,
    /// Do not compute the geodesic between the first and the last shape for comparison.
    #[arg(long)]
    pub no_geodesic: bool,
    /// Parameters of the paths; the number of steps is that between two consecutive shapes.
    #[serde(flatten)]
    #[command(flatten)]
    pub params: GeodesicParams,
}

impl Default for LengthConfig {
    fn default() -> Self {
        Self {
            inputs: Vec::new(),
            masks: MaskOptions::default(),
            like: None,
            no_geodesic: false,
            params: GeodesicParams {
                steps: 1,
                ..GeodesicParams::default()
            },
        }
    }
}

impl Config for LengthConfig {
    const COMMAND: &'static str = "length";

    fn may_align(&self) -> bool {
        self.masks.may_align()
    }

    fn check(&self) -> Result<(), CliError> {
        let found = self.inputs.len();
        at_least(2, Self::COMMAND, &self.inputs)?;
        check_path(&self.params)?;
        check_form(&self.params)?;
        let steps = (found - 1) * self.params.steps;
        allow(
            steps <= MOST_STEPS,
            "steps",
            &steps,
            "at most 256 for the whole path: leave out shapes, or choose fewer steps between them",
        )
    }

    fn inputs(&mut self) -> Vec<(&mut Vec<PathBuf>, Kinds)> {
        vec![(&mut self.inputs, Kinds::Masks)]
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        self.inputs.iter_mut().collect()
    }
}
