//! Options of `shapespace segment`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use phasefield::segmentation::SegmentationParams;
use serde::{Deserialize, Serialize};

use crate::config::{Config, allow};
use crate::error::CliError;
use crate::numbers::shown;
use crate::options::ScaleOptions;
use shapespace_input::Kinds;

/// Configuration of `shapespace segment`.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct SegmentConfig {
    /// Grey images: PNG, JPEG, PGM, PPM, TIFF, BMP, .npy, NIfTI, NRRD or MetaImage. A folder, or a
    /// pattern in quotes, stands for its files.
    #[arg(value_name = "IMAGE")]
    pub inputs: Vec<PathBuf>,
    /// Number of nodes along the longest side, 2^L + 1 or another m 2^L + 1 [default: from the number
    /// of samples, at most 513, for volumes 129].
    #[arg(long, value_name = "N")]
    pub grid: Option<usize>,
    /// Scales of the segmentation.
    #[serde(flatten)]
    #[command(flatten)]
    pub scales: ScaleOptions,
    /// How the object is distinguished from the background.
    #[arg(long, value_enum)]
    pub object: Object,
    /// Threshold between the object and the background, in grey values of the file [default: the
    /// one that separates the smoothed values best].
    #[arg(long, value_name = "GREY")]
    pub threshold: Option<f64>,
    /// Number of classes of grey values; the object is the brightest or the darkest class.
    #[arg(long, value_name = "N", help_heading = "Computation")]
    pub classes: usize,
    /// Keep only the largest connected component of the object.
    #[arg(long)]
    pub largest: bool,
    /// Masks of the true objects, one per image and of its size, for comparison.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[arg(long, value_name = "MASK", num_args = 1..)]
    pub truth: Vec<PathBuf>,
    /// Parameters of the segmentation.
    #[serde(flatten)]
    #[command(flatten)]
    pub params: SegmentationParams,
}

/// Default number of classes of grey values.
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
                value: shown(threshold),
                remedy: format!("it {remedy} {other}: leave one of the two out"),
            });
        }
        if !by_grey && self.classes != CLASSES {
            return Err(CliError::Option {
                option: "--classes",
                value: self.classes.to_string(),
                remedy: format!("it goes with {other}: leave one of the two out"),
            });
        }
        let threshold = self.threshold.unwrap_or(0.0);
        allow(
            threshold.is_finite(),
            "threshold",
            &shown(threshold),
            "a number",
        )?;
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

    fn inputs(&mut self) -> Vec<(&mut Vec<PathBuf>, Kinds)> {
        vec![
            (&mut self.inputs, Kinds::Images),
            (&mut self.truth, Kinds::Images),
        ]
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

/// How the object is distinguished from the background.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Object {
    /// Brighter than the background.
    #[default]
    Bright,
    /// Darker than the background.
    Dark,
    /// Separated by edges from the largest region, whatever its grey value.
    Enclosed,
    /// No object: edges only.
    None,
}
