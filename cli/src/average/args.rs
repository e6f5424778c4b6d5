//! Options of `shapespace average`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use crate::bytes::bytes;
use crate::numbers::{finite, not_negative, positive};
use crate::options::{CommonArgs, ScaleArgs};

/// Options of `shapespace average`.
#[derive(Clone, Debug, Args)]
pub struct AverageArgs {
    /// Masks: PNG, PGM, PBM, PPM, TIFF, BMP, .npy, .nii or .nii.gz; the object bright.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// Options that other commands have, too.
    #[command(flatten)]
    pub common: CommonArgs,
    /// How the energy is minimised.
    #[arg(long, value_enum, default_value_t)]
    pub solver: Solver,
    /// A level ends when five iterations lower the energy's excess over the least possible
    /// mismatch by less than this share.
    #[arg(long, value_name = "SHARE", default_value_t = 2e-4, value_parser = positive)]
    pub tolerance: f64,
    /// Weights of the shapes, adding up to 1 [default: all equal].
    #[arg(long, value_name = "W,W,..", value_delimiter = ',', value_parser = finite,
          allow_hyphen_values = true)]
    pub weights: Vec<f64>,
    /// What of the elastic energies is least: their sum, or that of their roots, which a few shapes
    /// of another kind move little.
    #[arg(long, value_enum, default_value_t)]
    pub mean: Mean,
    /// What was seen of each input, bright there, of its size; 'all' where everything was. Nothing is
    /// compared with the average where an input was not seen.
    #[arg(long, value_name = "MASK", num_args = 1.., conflicts_with = "joint")]
    pub valid: Vec<PathBuf>,
    /// Averages two or three shapes with all weights on a line or in a triangle, N on a side.
    #[arg(long, value_name = "N", conflicts_with_all = ["weights", "joint"],
          value_parser = clap::value_parser!(u32).range(2..=65))]
    pub sweep: Option<u32>,
    /// The inputs are grey images of about one size: their edges are found and averaged at the same time.
    #[arg(long)]
    pub joint: bool,
    /// With --joint: how edges and smoothness are weighed.
    #[command(flatten)]
    pub scales: ScaleArgs,
    /// With --joint: weight of the length of an image's edges, as a share of the mismatch weight
    /// [default: 2].
    #[arg(long, value_name = "SHARE", value_parser = positive)]
    pub edge_weight: Option<f64>,
    /// Weight of the mismatch between the shapes and the average.
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    pub mismatch_weight: f64,
    /// Weight of the average's boundary length [default: 1e-4 of the mismatch weight].
    #[arg(long, value_parser = positive)]
    pub length_weight: Option<f64>,
    /// What the deformations do at the border of the box [default: natural; with --joint identity].
    #[arg(long, value_enum)]
    pub boundary: Option<Boundary>,
    /// Begins with the deformations of an earlier average of the same inputs, in their order: one
    /// that was stopped, or of other parameters, on this grid or a coarser one.
    #[arg(long, value_name = "DIR", conflicts_with = "sweep")]
    pub start: Option<PathBuf>,
    /// Minutes between checkpoints, 0 for none: after a sudden end the same command goes on from the
    /// last one, which is kept in OUTPUT.partial until the result is written.
    #[arg(long, value_name = "MINUTES", default_value_t = 10.0, value_parser = not_negative)]
    pub checkpoint: f64,
    /// Most memory to use, such as 4GiB or 500MB; what does not fit goes to temporary files beside
    /// the output, or in TMPDIR. The results do not depend on it.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub memory: Option<u64>,
}

/// What of the elastic energies is least.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mean {
    /// Their weighted sum.
    #[default]
    Arithmetic,
    /// The weighted sum of their roots.
    Median,
}

/// How the energy is minimised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// Limited-memory BFGS with a multigrid metric, the phase field eliminated.
    #[default]
    Lbfgs,
    /// Alternating gradient descent.
    Descent,
}

/// What the deformations do at the border of the box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Boundary {
    /// Free.
    #[default]
    Natural,
    /// The identity.
    Identity,
}
