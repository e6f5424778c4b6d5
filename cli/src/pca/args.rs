//! Options of `shapespace pca`, `shapespace synthesize` and `shapespace score`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use crate::numbers::{finite, positive};
use crate::options::Align;

/// Options of `shapespace pca`.
#[derive(Clone, Debug, Args)]
pub struct PcaArgs {
    /// Directory that `shapespace average` has written.
    #[arg(value_name = "AVERAGE")]
    pub average: PathBuf,
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Inner product of displacements.
    #[arg(long, value_enum, default_value_t)]
    pub metric: Metric,
    /// Most modes [default: all].
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..))]
    pub modes: Option<u32>,
    /// Takes the average object at rest, without the stresses of the deformations in it.
    #[arg(long)]
    pub at_rest: bool,
    /// Modes are drawn up to so many standard deviations.
    #[arg(long, value_name = "A", default_value_t = 2.0, value_parser = positive)]
    pub amplitude: f64,
    /// Linear problems are solved until the residual is this share of the load.
    #[arg(long, value_name = "SHARE", default_value_t = 1e-9, value_parser = positive)]
    pub tolerance: f64,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}

/// Inner product of displacements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// The integral of `u . v` over the average object.
    #[default]
    L2,
    /// The second variation of the elastic energy: stiff parts count more.
    Hessian,
}

/// Options of `shapespace synthesize`.
#[derive(Clone, Debug, Args)]
pub struct SynthesizeArgs {
    /// Directory that `shapespace pca` has written.
    #[arg(value_name = "PCA")]
    pub pca: PathBuf,
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Scores in the first modes, in standard deviations.
    #[arg(long, value_name = "S,S,..", value_delimiter = ',', required = true,
          value_parser = finite, allow_hyphen_values = true)]
    pub scores: Vec<f64>,
    /// Solves the nonlinear elastic problem under the load of the modes; without it the shape is
    /// the average moved by their displacements.
    #[arg(long)]
    pub nonlinear: bool,
    /// Steps in which the load is applied.
    #[arg(long, value_name = "N", default_value_t = 4,
          value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub load_steps: u32,
    /// Where the average lies, if it has been moved since.
    #[arg(long, value_name = "DIR")]
    pub average: Option<PathBuf>,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}

/// Options of `shapespace score`.
#[derive(Clone, Debug, Args)]
pub struct ScoreArgs {
    /// Masks of new shapes, of the same formats as for an average.
    #[arg(required = true, value_name = "NEW")]
    pub inputs: Vec<PathBuf>,
    /// Directory that `shapespace pca` has written.
    #[arg(long, value_name = "PCA")]
    pub pca: PathBuf,
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Alignment of a new shape with the average [default: as the shapes of the average].
    #[arg(long, value_enum)]
    pub align: Option<Align>,
    /// Size of a new shape beside those of the average.
    #[arg(long, value_enum, default_value_t)]
    pub size: Size,
    /// In label images, the label of the object [default: every label but 0].
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub label: Option<i64>,
    /// Where the average lies, if it has been moved since.
    #[arg(long, value_name = "DIR")]
    pub average: Option<PathBuf>,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}

/// Size of a new shape beside those of the average.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Size {
    /// In the length units of the files.
    #[default]
    Kept,
    /// Of the area or volume of the average: for pictures of other resolution.
    Equal,
}
