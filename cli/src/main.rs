//! The `shapespace` program.

#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let command = shapespace::args::Cli::parse();
    shapespace::processes::run(command.is_distributed(), || shapespace::args::run(&command))
}
