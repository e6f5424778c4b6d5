//! The command line.

use clap::{Parser, Subcommand};

use crate::average::{AverageArgs, run_average};
use crate::calculus::{ExtendConfig, TransportConfig};
use crate::check::{CheckArgs, run_check};
use crate::compare::CompareConfig;
use crate::config::{ConfigArgs, run_config};
use crate::demo::{DemoArgs, run_demo};
use crate::distances::{DistancesArgs, run_distances};
use crate::error::{CliError, Exit};
use crate::examples::examples;
use crate::figure::{FigureArgs, run_figure};
use crate::generate::{GenerateArgs, run_generate};
use crate::geodesic::GeodesicConfig;
use crate::length::LengthConfig;
use crate::metric::MetricConfig;
use crate::pca::{PcaConfig, ScoreConfig, SynthesizeConfig};
use crate::pool::in_pool;
use crate::segment::SegmentConfig;
use crate::session::{ComputeArgs, LongArgs};
use crate::verify::{VerifyArgs, run_verify};
use crate::warp::{WarpArgs, run_warp};
use shapespace_input::terminal::note;

/// Averages of 2D and 3D shapes, their modes of variation, geodesics and distances between them, and
/// shapes in images.
#[derive(Debug, Parser)]
#[command(name = "shapespace", version, about, arg_required_else_help = true)]
#[command(after_help = "\
Exit codes: 0 the result is sound, 1 the computation failed, 2 the inputs or options cannot be
used, 3 the result was written and is doubtful (0 with --allow-doubtful), 130 interrupted.")]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

impl Cli {
    /// Whether several processes can run the command together.
    pub fn is_distributed(&self) -> bool {
        matches!(
            self.command,
            Command::Average(_) | Command::Distances(_) | Command::Pca(_) | Command::Score(_)
        )
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Computes the elastic average of two or more shapes in masks or grey images.
    #[command(after_help = examples("average"))]
    Average(Box<AverageArgs>),
    /// Computes the geodesic (shortest path) between two shapes in masks.
    #[command(after_help = examples("geodesic"))]
    Geodesic(Box<LongArgs<GeodesicConfig>>),
    /// Measures a given path: its length and dissipation, beside those of the geodesic.
    #[command(after_help = examples("length"))]
    Length(LongArgs<LengthConfig>),
    /// Computes the metric of a variation of a shape, and the optimal velocity of the fluid in it.
    #[command(after_help = examples("metric"))]
    Metric(LongArgs<MetricConfig>),
    /// Continues a geodesic beyond its end (discrete exponential map).
    #[command(after_help = examples("extend"))]
    Extend(LongArgs<ExtendConfig>),
    /// Transports a variation of the first shape of a geodesic in parallel to the last.
    #[command(after_help = examples("transport"))]
    Transport(LongArgs<TransportConfig>),
    /// Computes the distances between all pairs of shapes, with clusters and an embedding.
    #[command(after_help = examples("distances"))]
    Distances(Box<DistancesArgs>),
    /// Segments grey images: their edges, and the objects bounded by them.
    #[command(after_help = examples("segment"))]
    Segment(LongArgs<SegmentConfig>),
    /// Computes the principal modes of variation of the shapes of an average.
    #[command(after_help = examples("pca"))]
    Pca(LongArgs<PcaConfig>),
    /// Computes a shape from its scores in the modes of variation.
    #[command(after_help = examples("synthesize"))]
    Synthesize(LongArgs<SynthesizeConfig>),
    /// Computes the scores of new shapes in the modes of variation.
    #[command(after_help = examples("score"))]
    Score(LongArgs<ScoreConfig>),
    /// Tests whether groups of shapes differ, where, and whether they can be told apart.
    #[command(after_help = examples("compare"))]
    Compare(ComputeArgs<CompareConfig>),
    #[command(after_help = examples("warp"))]
    Warp(WarpArgs),
    /// Draws a figure with a table that compares averages, modes or paths, on built-in shapes or masks.
    #[command(after_help = examples("figure"))]
    Figure(FigureArgs),
    /// Runs numerical experiments that check the theory.
    #[command(after_help = examples("verify"))]
    Verify(VerifyArgs),
    #[command(after_help = examples("check"))]
    Check(CheckArgs),
    /// Prints the default configuration of a command as commented TOML, for its `--config`.
    #[command(after_help = examples("config"))]
    Config(ConfigArgs),
    #[command(after_help = examples("demo"))]
    Demo(DemoArgs),
    #[command(after_help = examples("generate"))]
    Generate(GenerateArgs),
}

/// Runs the command of a command line.
///
/// # Errors
/// [`CliError`], which holds the exit code and prints its own report.
pub fn run(cli: &Cli) -> Result<Exit, CliError> {
    match &cli.command {
        Command::Average(args) => run_average(args),
        Command::Geodesic(args) => args.run(),
        Command::Length(args) => args.run(),
        Command::Metric(args) => args.run(),
        Command::Extend(args) => args.run(),
        Command::Transport(args) => args.run(),
        Command::Distances(args) => run_distances(args),
        Command::Segment(args) => args.run(),
        Command::Pca(args) => args.run(),
        Command::Synthesize(args) => args.run(),
        Command::Score(args) => args.run(),
        Command::Compare(args) => args.run(),
        Command::Warp(args) => run_warp(args),
        Command::Figure(args) => run_figure(args),
        Command::Verify(args) => run_verify(args),
        Command::Check(args) => in_pool(None, || run_check(args)),
        Command::Config(args) => run_config(args),
        Command::Demo(args) => in_pool(args.threads, || run_demo(args)),
        Command::Generate(args) => {
            for path in in_pool(None, || run_generate(args))? {
                note(format!("wrote {}", path.display()));
            }
            Ok(Exit::Success)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doubts::{OPTIONS, options_in};
    use clap::CommandFactory;
    use levelset::Cause;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    /// Remedies name options: the list says which commands have them.
    #[test]
    fn options_of_remedies_are_those_of_the_commands() {
        let all = Cli::command();
        for cause in Cause::ALL {
            for option in options_in(cause.criterion().remedy) {
                let has = |command: &&clap::Command| {
                    let mut options = command.get_arguments();
                    options.any(|of| of.get_long() == option.strip_prefix("--"))
                };
                let commands = all.get_subcommands().filter(has);
                let mut commands: Vec<&str> = commands.map(clap::Command::get_name).collect();
                let listed = OPTIONS.iter().find(|(name, _)| *name == option);
                let mut listed = listed.map_or(Vec::new(), |(_, listed)| listed.to_vec());
                commands.sort_unstable();
                listed.sort_unstable();
                assert_eq!(listed, commands, "{option} of {cause:?}");
            }
        }
    }
}
