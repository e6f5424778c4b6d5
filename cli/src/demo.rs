//! `shapespace demo`: the average of three letters that the program draws itself.

use std::path::PathBuf;

use clap::Args;
use fe_grid::Grid;
use shapespace_generate::letters;

use crate::average::{AverageConfig, AverageRun, run_drawn};
use crate::error::{CliError, Exit};
use crate::figure::drawn_image;
use crate::options::{CheckpointOption, MaskOptions, Nodes, RunOptions};
use shapespace_input::Image;

/// Nodes per side.
const NODES: usize = 129;
/// Default name of the directory, with a number appended where it exists.
const NAME: &str = "shapespace-demo";

/// Averages built-in shapes, as a first example without data.
#[derive(Clone, Debug, Args)]
pub struct DemoArgs {
    /// New directory for the results [default: shapespace-demo, with a number appended if it
    /// exists].
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Number of threads [default: all cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}

/// Runs `shapespace demo`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_demo(args: &DemoArgs) -> Result<Exit, CliError> {
    let output = args.output.clone().unwrap_or_else(free_name);
    let folder = output.join("inputs");
    let grid = Grid::<2>::cube(NODES);
    let images: Vec<Image<2>> = letters()
        .iter()
        .map(|member| drawn_image(&member.name, member.shape.as_ref(), grid, &folder))
        .collect();
    let masks = MaskOptions {
        grid: Some(Nodes::Cube(NODES)),
        ..MaskOptions::default()
    };
    run_drawn(
        images,
        AverageConfig {
            masks,
            ..AverageConfig::default()
        },
        &AverageRun {
            common: RunOptions {
                output,
                threads: args.threads,
                allow_doubtful: false,
                trust: false,
                quiet: false,
                log: None,
            },
            checkpoint: CheckpointOption::NONE,
            memory: None,
        },
    )
}

/// The first name that is not in use.
fn free_name() -> PathBuf {
    let names = std::iter::once(NAME.to_owned()).chain((2..).map(|k| format!("{NAME}-{k}")));
    let mut free = names
        .map(PathBuf::from)
        .filter(|path| path.symlink_metadata().is_err());
    free.next().unwrap_or_else(|| NAME.into())
}
