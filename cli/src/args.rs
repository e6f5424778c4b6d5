//! The command line.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use hyperelastic::LawName;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

use crate::average::{bytes, run_average};
use crate::demo::{DemoArgs, run_demo};
use crate::error::{CliError, Exit};
use crate::generate::command::{GenerateArgs, finite, positive, run_generate};

/// Averages of 2D and 3D shapes.
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
    Demo(DemoArgs),
    Generate(GenerateArgs),
}

/// Options of `shapespace average`.
#[derive(Clone, Debug, Args)]
pub struct AverageArgs {
    /// Masks: PNG, PGM, PBM, PPM, TIFF, BMP, .npy, .nii or .nii.gz; the object bright.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Nodes a side, 2^L + 1 [default: 129, for volumes 65].
    #[arg(long, value_name = "N")]
    pub grid: Option<usize>,
    /// How the energy is minimised.
    #[arg(long, value_enum, default_value_t)]
    pub solver: Solver,
    /// A level ends when five iterations lower the energy's excess over the least possible
    /// mismatch by less than this share.
    #[arg(long, value_name = "SHARE", default_value_t = 2e-4, value_parser = positive)]
    pub tolerance: f64,
    /// Most iterations on a level.
    #[arg(long, value_name = "N", default_value_t = 100,
          value_parser = clap::value_parser!(u32).range(1..))]
    pub max_iterations: u32,
    /// Weights of the shapes, adding up to 1 [default: all equal].
    #[arg(long, value_name = "W,W,..", value_delimiter = ',', value_parser = finite,
          allow_hyphen_values = true)]
    pub weights: Vec<f64>,
    /// Law of the elastic material; "inverse:..." is its inverse model.
    #[arg(long, value_name = "LAW", default_value_t, value_parser = laws())]
    pub law: LawName,
    /// First Lame modulus.
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    pub lambda: f64,
    /// Second Lame modulus, the shear modulus.
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    pub mu: f64,
    /// Weight of the mismatch between the shapes and the average.
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    pub mismatch_weight: f64,
    /// Weight of the average's boundary length [default: 1e-4 of the mismatch weight].
    #[arg(long, value_parser = positive)]
    pub length_weight: Option<f64>,
    /// Stiffness outside the objects, theirs being 1.
    #[arg(long, default_value_t = 1e-4, value_parser = positive)]
    pub void_stiffness: f64,
    /// Alignment of the shapes before averaging.
    #[arg(long, value_enum, default_value_t)]
    pub align: Align,
    /// What the deformations do at the border of the box.
    #[arg(long, value_enum, default_value_t)]
    pub boundary: Boundary,
    /// In label images, the label of the object [default: every label but 0].
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub label: Option<i64>,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Most memory to use, such as 4GiB or 500MB; what does not fit goes to temporary files beside
    /// the output, or in TMPDIR. The results do not depend on it.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub memory: Option<u64>,
}

/// The names of all laws.
fn laws() -> impl TypedValueParser<Value = LawName> {
    let names: Vec<String> = LawName::all().map(|law| law.to_string()).collect();
    PossibleValuesParser::new(names).try_map(|name| name.parse::<LawName>())
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

/// Alignment of the shapes before averaging.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Align {
    /// The shapes stay as they are placed.
    #[default]
    None,
    /// The shapes are turned and moved onto each other.
    Rigid,
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
