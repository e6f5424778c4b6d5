//! The threads that a command works on.

use crate::error::CliError;

/// Runs work on a number of threads, or on all cores.
///
/// # Errors
/// [`CliError::Computation`] where the threads cannot be started, and those of the work.
pub(crate) fn in_pool<T: Send>(
    threads: Option<u32>,
    work: impl FnOnce() -> Result<T, CliError> + Send,
) -> Result<T, CliError> {
    let mut work = Some(work);
    let mut result = None;
    on_threads(threads.unwrap_or(0) as usize, &mut || {
        result = work.take().map(|work| work());
    })?;
    // `on_threads` runs the closure once where it succeeds.
    result.expect("the work is done once")
}

/// Not generic: the scheduler is compiled once, and not for the work of every command.
fn on_threads(threads: usize, work: &mut (dyn FnMut() + Send)) -> Result<(), CliError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| no_threads(&error))?;
    // Every thread has begun before the work takes memory: where the C library finds none for what a thread
    // keeps for its end, it aborts the program.
    pool.broadcast(|_| ());
    pool.install(work);
    Ok(())
}

/// The error where the system does not start threads.
pub(crate) fn no_threads(error: &dyn std::error::Error) -> CliError {
    CliError::Computation {
        message: format!("the threads cannot be started: {error}"),
        remedy: "ask for fewer with --threads".into(),
    }
}
