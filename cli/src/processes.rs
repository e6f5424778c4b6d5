//! The processes that a command runs on: one, or those that `mpirun` has started.
//!
//! With the feature `mpi`, processes that an MPI launcher has started compute one result together: the
//! first reads, reports and writes, as a single one would; the others help with the computation.

use std::process::ExitCode;
use std::sync::{Arc, OnceLock};

use fe_grid::communicator::{Alone, Communicator};

use crate::error::{CliError, Exit};
use crate::interrupt::listen;

#[cfg(feature = "mpi")]
mod mpi;

/// The processes of this run, where there are several.
static PROCESSES: OnceLock<Arc<dyn Communicator>> = OnceLock::new();

/// What a launcher tells the processes that it has started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Launched {
    /// How many there are.
    size: usize,
    /// Which one this is.
    rank: usize,
    /// Whether they are certainly meant to work together. Slurm's `srun` also starts processes that do
    /// not know of each other, such as parts of an array.
    together: bool,
}

/// The processes of this run.
pub(crate) fn processes() -> Arc<dyn Communicator> {
    let several = PROCESSES.get().map(Arc::clone);
    several.unwrap_or_else(|| Arc::new(Alone))
}

/// The number of processes of this run on this machine.
pub(crate) fn on_this_machine() -> u64 {
    let counts = ["OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS"];
    let found = counts
        .into_iter()
        .find_map(|name| std::env::var(name).ok()?.parse().ok());
    found.unwrap_or(1).max(1)
}

/// What the launcher of this process says; `None` if it was not started by one, or alone.
fn launched(variable: &dyn Fn(&str) -> Option<String>) -> Option<Launched> {
    let number = |name: &str| variable(name)?.parse().ok();
    let of = |[size, rank]: [&str; 2], together| {
        Some(Launched {
            size: number(size)?,
            rank: number(rank)?,
            together,
        })
    };
    let hydra = variable("MPI_LOCALNRANKS").is_some();
    let found = of(["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"], true)
        .or_else(|| of(["PMI_SIZE", "PMI_RANK"], hydra))
        .or_else(|| of(["SLURM_STEP_NUM_TASKS", "SLURM_PROCID"], false));
    found.filter(|launched| launched.size > 1)
}

/// Runs a command, on all processes that a launcher has started if it can be `distributed`; reports an
/// error.
pub fn run(distributed: bool, work: impl FnOnce() -> Result<Exit, CliError>) -> ExitCode {
    let Some(launched) = launched(&|name| std::env::var(name).ok()) else {
        listen();
        return done(work());
    };
    if distributed {
        // A signal ends the first process, and the others with it.
        if launched.rank == 0 {
            listen();
        }
        return on_processes(launched, work);
    }
    if !launched.together {
        listen();
        return done(work());
    }
    refused(
        launched,
        &CliError::OneProcess {
            command: "this command",
            processes: launched.size,
        },
    )
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

/// Reports an error that all processes have, once.
fn refused(launched: Launched, error: &CliError) -> ExitCode {
    if launched.rank == 0 {
        error.report();
    }
    error.exit().into()
}

#[cfg(feature = "mpi")]
fn on_processes(launched: Launched, work: impl FnOnce() -> Result<Exit, CliError>) -> ExitCode {
    mpi::run(launched, work)
}

#[cfg(not(feature = "mpi"))]
fn on_processes(launched: Launched, _work: impl FnOnce() -> Result<Exit, CliError>) -> ExitCode {
    let processes = launched.size;
    refused(launched, &CliError::WithoutMpi { processes })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launchers_are_known_by_their_variables() {
        let found = |variables: &[(&str, &str)]| {
            launched(&|name| {
                let found = variables.iter().find(|(key, _)| *key == name);
                found.map(|(_, value)| (*value).to_owned())
            })
        };
        let of = |rank, together| {
            Some(Launched {
                size: 4,
                rank,
                together,
            })
        };
        let open_mpi = [("OMPI_COMM_WORLD_SIZE", "4"), ("OMPI_COMM_WORLD_RANK", "2")];
        assert_eq!(found(&open_mpi), of(2, true));
        let hydra = [
            ("PMI_SIZE", "4"),
            ("PMI_RANK", "0"),
            ("MPI_LOCALNRANKS", "4"),
        ];
        assert_eq!(found(&hydra), of(0, true));
        assert_eq!(found(&hydra[..2]), of(0, false));
        let slurm = [("SLURM_STEP_NUM_TASKS", "4"), ("SLURM_PROCID", "3")];
        assert_eq!(found(&slurm), of(3, false));
        // Alone, or nonsense.
        let alone = [("OMPI_COMM_WORLD_SIZE", "1"), ("OMPI_COMM_WORLD_RANK", "0")];
        assert_eq!(found(&alone), None);
        assert_eq!(found(&[("PMI_SIZE", "four"), ("PMI_RANK", "0")]), None);
        assert_eq!(found(&[]), None);
    }
}
