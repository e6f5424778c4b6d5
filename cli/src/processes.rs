//! The processes that a command runs on: one, or those that `mpirun` has started.
//!
//! With the feature `mpi`, processes that an MPI launcher has started compute one result together: the
//! first reads, reports and writes, as a single one would; the others help with the computation.

use std::process::ExitCode;
use std::sync::{Arc, OnceLock};

use fe_grid::communicator::{Alone, Communicator};

use crate::error::{CliError, Exit};

#[cfg(feature = "mpi")]
mod mpi;

/// The processes of this run, where there are several.
static PROCESSES: OnceLock<Arc<dyn Communicator>> = OnceLock::new();

/// What launchers tell the processes that they start: how many there are, and which one this is.
const LAUNCHERS: [[&str; 2]; 3] = [
    ["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"],
    ["PMI_SIZE", "PMI_RANK"],
    ["MPI_LOCALNRANKS", "MPI_LOCALRANKID"],
];

/// The processes of this run.
pub(crate) fn processes() -> Arc<dyn Communicator> {
    let several = PROCESSES.get().map(Arc::clone);
    several.unwrap_or_else(|| Arc::new(Alone))
}

/// The number of processes that a launcher has started, and the number of this one; `None` if it was not
/// started by one, or alone.
fn launched() -> Option<[usize; 2]> {
    let number = |name: &str| std::env::var(name).ok()?.parse().ok();
    let found = LAUNCHERS
        .iter()
        .find_map(|[size, rank]| Some([number(size)?, number(rank)?]));
    found.filter(|[size, _]| *size > 1)
}

/// The number of processes of this run on this machine.
pub(crate) fn on_this_machine() -> u64 {
    let number = |name: &str| std::env::var(name).ok()?.parse().ok();
    let counts = ["OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS"];
    let found = counts.into_iter().find_map(number);
    found.unwrap_or(1).max(1)
}

/// Whether this process is the only one, or the first of those that a launcher has started.
pub fn is_first() -> bool {
    launched().is_none_or(|[_, rank]| rank == 0)
}

/// Runs the program, on all processes that a launcher has started; reports an error.
pub fn run(work: impl FnOnce() -> Result<Exit, CliError>) -> ExitCode {
    let Some([size, rank]) = launched() else {
        return done(work());
    };
    on_processes(size, rank, work)
}

fn done(found: Result<Exit, CliError>) -> ExitCode {
    match found {
        Ok(exit) => exit.into(),
        Err(error) => {
            error.report();
            error.exit().into()
        }
    }
}

#[cfg(feature = "mpi")]
fn on_processes(
    _size: usize,
    _rank: usize,
    work: impl FnOnce() -> Result<Exit, CliError>,
) -> ExitCode {
    mpi::run(work)
}

#[cfg(not(feature = "mpi"))]
fn on_processes(
    size: usize,
    rank: usize,
    _work: impl FnOnce() -> Result<Exit, CliError>,
) -> ExitCode {
    let error = CliError::WithoutMpi { processes: size };
    if rank == 0 {
        error.report();
    }
    error.exit().into()
}

/// Refuses several processes for a command that runs on one.
///
/// # Errors
/// [`CliError::OneProcess`].
pub(crate) fn need_one(command: &'static str) -> Result<(), CliError> {
    match processes().size() {
        1 => Ok(()),
        processes => Err(CliError::OneProcess { command, processes }),
    }
}
