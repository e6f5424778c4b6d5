//! The benchmarks: speed of the kernels and the averages, relative to the limits of the machine and
//! to other programs.
//!
//! Values are the minimum over many repetitions, in processor time, so that other work on the
//! machine has little influence; compared programs are measured in turn, in one run.

mod anchor;
mod averages;
mod baseline;
mod case;
mod check;
mod clock;
mod descents;
mod fit;
mod flops;
mod geodesics;
mod job;
mod kernels;
mod limits;
mod machine;
mod measure;
mod output;
mod paths;
mod peers;
mod reference;
mod scaling;
mod score;
mod shapes;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Measures speed.
///
/// Without a task, `--check` counts the instructions of the kernels and compares them with the
/// committed baseline.
#[derive(Parser)]
#[command(name = "cargo xtask bench", arg_required_else_help = true)]
struct Arguments {
    /// Count instructions under valgrind; more than 10 % above the baseline fails.
    #[arg(long)]
    check: bool,
    /// Write the counts as the new baseline.
    #[arg(long, requires = "check")]
    bless: bool,
    #[command(subcommand)]
    task: Option<Task>,
}

#[derive(Subcommand)]
enum Task {
    Kernels(kernels::Arguments),
    Scaling(scaling::Arguments),
    Peers(peers::Arguments),
    Reference(reference::Arguments),
    Geodesics(geodesics::Arguments),
    #[command(hide = true)]
    Job(job::Arguments),
}

/// Runs the task.
pub fn run(arguments: &[String]) -> ExitCode {
    let name = std::iter::once("bench".to_owned());
    let arguments = match Arguments::try_parse_from(name.chain(arguments.iter().cloned())) {
        Ok(arguments) => arguments,
        Err(error) => error.exit(),
    };
    let outcome = match (arguments.task, arguments.check) {
        (Some(Task::Kernels(arguments)), _) => kernels::run(&arguments),
        (Some(Task::Scaling(arguments)), _) => scaling::run(&arguments),
        (Some(Task::Peers(arguments)), _) => peers::run(&arguments),
        (Some(Task::Reference(arguments)), _) => reference::run(&arguments),
        (Some(Task::Geodesics(arguments)), _) => geodesics::run(&arguments),
        (Some(Task::Job(arguments)), _) => job::run(&arguments),
        (None, true) => check::run(arguments.bless),
        (None, false) => Err("a task or --check is needed (bench --help)".into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
