//! Options of `shapespace segment`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use phasefield::segmentation::SegmentationParams;
use serde::{Deserialize, Serialize};

use crate::config::{Config, Configured, allow};
use crate::error::CliError;
use crate::options::{RunOptions, ScaleOptions};

/// Options of `shapespace segment`.
#[derive(Clone, Debug, Args)]
pub struct SegmentArgs {
    /// What is computed.
    #[command(flatten)]
    pub config: Configured<SegmentConfig>,
    /// What the results do not depend on.
    #[command(flatten)]
    pub run: RunOptions,
}

/// What `shapespace segment` computes.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct SegmentConfig {
    /// Grey images: PNG, PGM, PPM, TIFF, BMP, .npy, .nii or .nii.gz.
    #[arg(value_name = "IMAGE")]
    pub inputs: Vec<PathBuf>,
    /// Nodes along the longest side, 2^L + 1 [default: as the image has samples, at most 513, for
    /// volumes 129].
    #[arg(long, value_name = "N")]
    pub grid: Option<usize>,
    /// How edges and smoothness are weighed.
    #[serde(flatten)]
    #[command(flatten)]
    pub scales: ScaleOptions,
    /// Where the object is.
    #[arg(long, value_enum)]
    pub object: Object,
    /// Grey value between the object and the rest, in the numbers of the file [default: the one
    /// that separates the smoothed values best].
    #[arg(long, value_name = "GREY")]
    pub threshold: Option<f64>,
    /// Classes of grey values, of which the object is the brightest or the darkest.
    #[arg(long, value_name = "N")]
    pub classes: usize,
    /// Keep only the largest connected piece of the object.
    #[arg(long)]
    pub largest: bool,
    /// Masks of the true objects, one for each image and of its size, to compare with.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[arg(long, value_name = "MASK", num_args = 1..)]
    pub truth: Vec<PathBuf>,
    /// Parameters of the segmentation.
    #[serde(flatten)]
    #[command(flatten)]
    pub params: SegmentationParams,
}

/// Classes of grey values where nothing else is said.
const CLASSES: usize = 2;

impl Default for SegmentConfig {
    fn default() -> Self {
        Self {
            inputs: Vec::new(),
            grid: None,
            scales: ScaleOptions::default(),
            object: Object::default(),
            threshold: None,
            classes: CLASSES,
            largest: false,
            truth: Vec::new(),
            params: SegmentationParams::default(),
        }
    }
}

impl Config for SegmentConfig {
    const COMMAND: &'static str = "segment";

    fn check(&self) -> Result<(), CliError> {
        if self.inputs.is_empty() {
            return Err(CliError::Missing {
                command: Self::COMMAND,
                what: "an image",
            });
        }
        let by_grey = matches!(self.object, Object::Bright | Object::Dark);
        let other = if by_grey {
            "--classes"
        } else {
            "--object bright or dark"
        };
        if let Some(threshold) = self.threshold
            && (!by_grey || self.classes != CLASSES)
        {
            let remedy = if by_grey { "goes without" } else { "goes with" };
            return Err(CliError::Option {
                option: "--threshold",
                value: threshold.to_string(),
                remedy: format!("it {remedy} {other}: leave one of the two out"),
            });
        }
        let threshold = self.threshold.unwrap_or(0.0);
        allow(threshold.is_finite(), "threshold", &threshold, "a number")?;
        let classes = self.classes;
        allow((2..=8).contains(&classes), "classes", &classes, "2 to 8")?;
        let images = self.inputs.len();
        if !(self.truth.is_empty() || self.truth.len() == images) {
            return Err(wrong_truth(
                format!("{} masks", self.truth.len()),
                format!("give one for each of the {images} images"),
            ));
        }
        self.scales.check()?;
        let iterations = self.params.max_iterations;
        allow(iterations > 0, "max_iterations", &iterations, "at least 1")?;
        Ok(self.params.check()?)
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        self.inputs.iter_mut().chain(&mut self.truth).collect()
    }
}

pub(super) fn wrong_truth(value: String, remedy: String) -> CliError {
    CliError::Option {
        option: "--truth",
        value,
        remedy,
    }
}

/// Where the object is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Object {
    /// Brighter than the rest.
    #[default]
    Bright,
    /// Darker than the rest.
    Dark,
    /// What the edges part from the largest region, whatever its grey value.
    Enclosed,
    /// There is none: only edges are wanted.
    None,
}
