//! Options of `shapespace segment`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use crate::numbers::finite;
use crate::options::ScaleArgs;

/// Options of `shapespace segment`.
#[derive(Clone, Debug, Args)]
pub struct SegmentArgs {
    /// Grey images: PNG, PGM, PPM, TIFF, BMP, .npy, .nii or .nii.gz.
    #[arg(required = true, value_name = "IMAGE")]
    pub inputs: Vec<PathBuf>,
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Nodes along the longest side, 2^L + 1 [default: as the image has samples, at most 513, for
    /// volumes 129].
    #[arg(long, value_name = "N")]
    pub grid: Option<usize>,
    /// How edges and smoothness are weighed.
    #[command(flatten)]
    pub scales: ScaleArgs,
    /// Where the object is.
    #[arg(long, value_enum, default_value_t)]
    pub object: Object,
    /// Grey value between the object and the rest, in the numbers of the file [default: the one
    /// that separates the smoothed values best].
    #[arg(long, value_name = "GREY", allow_negative_numbers = true, value_parser = finite)]
    pub threshold: Option<f64>,
    /// Classes of grey values, of which the object is the brightest or the darkest.
    #[arg(long, value_name = "N", default_value_t = 2, conflicts_with = "threshold",
          value_parser = clap::value_parser!(u32).range(2..=8))]
    pub classes: u32,
    /// Keeps only the largest connected piece of the object.
    #[arg(long)]
    pub largest: bool,
    /// Masks of the true objects, one for each image and of its size, to compare with.
    #[arg(long, value_name = "MASK", num_args = 1..)]
    pub truth: Vec<PathBuf>,
    /// Most alternations of the two linear systems on a level.
    #[arg(long, value_name = "N", default_value_t = 200,
          value_parser = clap::value_parser!(u32).range(1..))]
    pub max_alternations: u32,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
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
