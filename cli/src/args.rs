//! The command line.

use clap::{Args, Parser, Subcommand, ValueEnum};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

use crate::average::{bytes, run_average};
use crate::calculus::{ExtendArgs, TransportArgs, run_extend, run_transport};
use crate::demo::{DemoArgs, run_demo};
use crate::distances::{DistancesArgs, run_distances};
use crate::error::{CliError, Exit};
use crate::figure::{FigureArgs, run_figure};
use crate::generate::command::{GenerateArgs, finite, not_negative, positive, run_generate};
use crate::geodesic::{GeodesicArgs, run_geodesic};
use crate::options::CommonArgs;
use crate::pca::{PcaArgs, ScoreArgs, SynthesizeArgs, run_pca, run_score, run_synthesize};
use crate::segment::{ScaleArgs, SegmentArgs, run_segment};
use crate::verify::{VerifyArgs, run_verify};

/// Averages of 2D and 3D shapes, their modes of variation, geodesics and distances between them, and
/// shapes in images.
#[derive(Debug, Parser)]
#[command(name = "shapespace", version, about, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// The elastic average of two or more shapes given as masks.
    Average(Box<AverageArgs>),
    /// The shortest path between two shapes given as masks.
    Geodesic(Box<GeodesicArgs>),
    /// A geodesic, continued beyond its end.
    Extend(ExtendArgs),
    /// The end of a geodesic, deformed as its start was: carries a variation along.
    Transport(TransportArgs),
    /// The distances between all pairs of shapes, with clusters and a map of them.
    Distances(Box<DistancesArgs>),
    /// The edges of grey images, and the objects between them.
    Segment(SegmentArgs),
    /// The principal modes of variation of the shapes of an average.
    Pca(PcaArgs),
    /// A shape from its scores in the modes of variation.
    Synthesize(SynthesizeArgs),
    /// The scores of new shapes in the modes of variation.
    Score(ScoreArgs),
    /// A figure with its table: what averages and modes do, on drawn or given shapes.
    Figure(FigureArgs),
    /// Tries the theory behind all this by numerical experiments.
    Verify(VerifyArgs),
    Demo(DemoArgs),
    Generate(GenerateArgs),
}

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

/// Runs the command of a command line.
///
/// # Errors
/// [`CliError`], which tells the exit code and reports itself.
pub fn run(cli: &Cli) -> Result<Exit, CliError> {
    match &cli.command {
        Command::Average(args) => run_average(args),
        Command::Geodesic(args) => run_geodesic(args),
        Command::Extend(args) => run_extend(args),
        Command::Transport(args) => run_transport(args),
        Command::Distances(args) => run_distances(args),
        Command::Segment(args) => run_segment(args),
        Command::Pca(args) => run_pca(args),
        Command::Synthesize(args) => run_synthesize(args),
        Command::Score(args) => run_score(args),
        Command::Figure(args) => run_figure(args),
        Command::Verify(args) => run_verify(args),
        Command::Demo(args) => run_demo(args),
        Command::Generate(args) => {
            for path in run_generate(args)? {
                eprintln!("wrote {}", path.display());
            }
            Ok(Exit::Success)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
