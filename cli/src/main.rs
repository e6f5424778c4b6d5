//! The `shapespace` program.

#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    if shapespace::processes::is_first() {
        shapespace::interrupt::listen();
    }
    let command = shapespace::args::Cli::parse();
    shapespace::processes::run(|| shapespace::args::run(&command))
}
