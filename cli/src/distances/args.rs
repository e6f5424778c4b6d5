//! Options of `shapespace distances`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use crate::geodesic::{Form, PathArgs};
use crate::numbers::positive;
use crate::options::CommonArgs;

/// Options of `shapespace distances`.
///
/// Shapes are moved onto each other pair by pair unless told otherwise: a length does not depend
/// on where shapes lie, but what a minimiser finds does. Half as many steps as for one path are
/// enough, since the mean of both directions is correct to second order in them.
#[derive(Clone, Debug, Args)]
#[command(
    mut_arg("align", |arg| arg.default_value("rigid").help(
        "Alignment of the two shapes of each pair before anything else")),
    mut_arg("steps", |arg| arg.default_value("4").help("Steps of each path")),
)]
pub struct DistancesArgs {
    /// Masks: PNG, PGM, PBM, PPM, TIFF, BMP, .npy, .nii or .nii.gz; the object bright.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// Options that other commands have, too.
    #[command(flatten)]
    pub common: CommonArgs,
    /// Options of paths.
    #[command(flatten)]
    pub path: PathArgs,
    /// Sizes of the shapes: as the files have them, or all of the same area or volume. Pictures of
    /// things at different distances need the latter.
    #[arg(long, value_enum, default_value_t)]
    pub size: Size,
    /// Compute each path in one direction only, from the earlier to the later shape: half the
    /// work, but distances that are correct to first order in the steps only.
    #[arg(long)]
    pub one_way: bool,
    /// Compute all paths with half as many steps, too, and extrapolate their lengths.
    #[arg(long)]
    pub richardson: bool,
    /// Overlap (Dice) with the end shape from which on a path counts as one to it [default: what
    /// `geodesic` asks for, 0.95 or boundaries a quarter of a spacing apart]. The length of a path
    /// that falls short is too small, and stays marked.
    #[arg(long, value_name = "DICE", value_parser = share)]
    pub reached: Option<f64>,
    /// Compute paths that do not reach their end, or fold, once more in this form.
    #[arg(long, value_enum, value_name = "FORM")]
    pub retry: Option<Form>,
    /// What the distance of two clusters is.
    #[arg(long, value_enum, default_value_t)]
    pub linkage: Linkage,
    /// Number of clusters [default: of the classes; without them, where the tree has its widest
    /// gap].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub clusters: Option<u32>,
    /// Known classes: "folder" or "prefix" for those of the names, or a file of lines
    /// "file,class".
    #[arg(long, value_name = "folder|prefix|FILE")]
    pub classes: Option<PathBuf>,
    /// Paths computed at the same time [default: one a thread]; fewer need less memory. The
    /// results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub at_once: Option<u32>,
}

/// A number above 0 and up to 1.
fn share(text: &str) -> Result<f64, String> {
    match positive(text)? {
        number if number <= 1.0 => Ok(number),
        _ => Err("a number above 0 and up to 1 is needed".into()),
    }
}

/// Sizes of the shapes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Size {
    /// As the files have them.
    #[default]
    Kept,
    /// All of the same area or volume.
    Equal,
}

/// What the distance of two clusters is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Linkage {
    /// That of their nearest members.
    Single,
    /// That of their farthest members.
    Complete,
    /// The mean over all pairs.
    #[default]
    Average,
    /// The growth of the sum of squares.
    Ward,
}

impl From<Linkage> for ::geodesic::distances::Linkage {
    fn from(linkage: Linkage) -> Self {
        match linkage {
            Linkage::Single => Self::Single,
            Linkage::Complete => Self::Complete,
            Linkage::Average => Self::Average,
            Linkage::Ward => Self::Ward,
        }
    }
}
