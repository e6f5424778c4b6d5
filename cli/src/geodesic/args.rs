//! Options of `shapespace geodesic`, and those of all paths.

use std::path::PathBuf;

use ::geodesic::GeodesicParams;
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use crate::error::CliError;
use crate::numbers::positive;
use crate::options::CommonArgs;

/// Options of `shapespace geodesic`.
#[derive(Clone, Debug, Args)]
pub struct GeodesicArgs {
    /// The first shape, a mask: PNG, PGM, PBM, PPM, TIFF, BMP, .npy, .nii or .nii.gz.
    #[arg(value_name = "START")]
    pub start: PathBuf,
    /// The last shape.
    #[arg(value_name = "END")]
    pub end: PathBuf,
    /// Options that other commands have, too.
    #[command(flatten)]
    pub common: CommonArgs,
    /// Options of paths that other commands have, too.
    #[command(flatten)]
    pub path: PathArgs,
    /// The inputs are label images: every label but 0 is a component, and becomes the component of
    /// the same label.
    #[arg(long, conflicts_with = "label")]
    pub labels: bool,
    /// A shape of which parts may be hidden, anywhere: only what is seen of it has to be covered.
    #[arg(long, value_enum, value_name = "SHAPE")]
    pub occluded: Option<Occluded>,
    /// A mask as large as START, bright where the start shape was seen: no mismatch is charged
    /// elsewhere.
    #[arg(long, value_name = "MASK", conflicts_with = "labels")]
    pub valid_start: Option<PathBuf>,
    /// A mask as large as END, bright where the end shape was seen.
    #[arg(long, value_name = "MASK", conflicts_with = "labels")]
    pub valid_end: Option<PathBuf>,
}

/// Options of every command that computes paths between shapes.
#[derive(Clone, Debug, Args)]
pub struct PathArgs {
    /// Steps of the path.
    #[arg(short = 'K', long, value_name = "K", default_value_t = 8,
          value_parser = clap::value_parser!(u32).range(1..=256))]
    pub steps: u32,
    /// In which unknowns the path is computed.
    #[arg(long, value_enum, default_value_t)]
    pub form: Form,
    /// A level ends when five iterations lower the energy by less than this share.
    #[arg(long, value_name = "SHARE", default_value_t = GeodesicParams::default().tolerance,
          value_parser = positive)]
    pub tolerance: f64,
    /// Weight of the match with the end shape, or of every shape with the next.
    #[arg(long, default_value_t = GeodesicParams::default().match_weight, value_parser = positive)]
    pub match_weight: f64,
    /// Weight of the boundary area of the shapes along the path, for level sets
    /// [default: 1e-3].
    #[arg(long, value_parser = positive)]
    pub area_weight: Option<f64>,
}

/// Which shape may be hidden in part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Occluded {
    /// The start shape.
    Start,
    /// The end shape.
    End,
    /// Both.
    Both,
}

impl PathArgs {
    /// Checks what belongs together.
    ///
    /// # Errors
    /// [`CliError::Option`] for a weight of a term that the form has not.
    pub(crate) fn check(&self) -> Result<(), CliError> {
        if self.area_weight.is_some() && self.form == Form::Lagrangian {
            return Err(CliError::Option {
                option: "--area-weight",
                value: "with --form lagrangian".into(),
                remedy: "leave it out, or choose --form level-sets: paths of one start domain \
                         have no area term"
                    .into(),
            });
        }
        Ok(())
    }
}

/// In which unknowns a path is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// Deformations of the first shape at all times: fast; all shapes have its topology.
    #[default]
    Lagrangian,
    /// A level set for every shape, and deformations of each into the next: shapes may merge,
    /// split, and close their holes.
    LevelSets,
}
