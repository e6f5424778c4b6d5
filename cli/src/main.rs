//! The `shapespace` program.

#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::Parser;
use fe_grid::ExitWithoutMemory;

/// Where the system refuses memory that was free when the computation began, or that is not counted, as the
/// threads' stacks and the pictures'.
#[global_allocator]
static ALLOCATOR: ExitWithoutMemory = ExitWithoutMemory {
    report: [
        "  × the system refuses ",
        " bytes of memory\n  help: close other programs, raise the limit of the address space (`ulimit -v`), use a coarser \
         --grid or fewer --threads; the same command goes on from its checkpoints, where it has any\n",
    ],
    code: 2,
};

fn main() -> ExitCode {
    let command = shapespace::args::Cli::parse();
    shapespace::processes::run(command.is_distributed(), || shapespace::args::run(&command))
}
