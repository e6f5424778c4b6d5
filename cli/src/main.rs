//! The `shapespace` program.

#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    shapespace::interrupt::listen();
    match shapespace::args::run(&shapespace::args::Cli::parse()) {
        Ok(exit) => exit.into(),
        Err(error) => {
            error.report();
            error.exit().into()
        }
    }
}
