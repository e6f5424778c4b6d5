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
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0) as usize)
        .build()
        .map_err(|error| CliError::Computation {
            message: format!("the threads cannot be started: {error}"),
            remedy: "ask for fewer with --threads".into(),
        })?
        .install(work)
}
