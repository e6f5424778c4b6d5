//! The memory of a computation: what it needs is said before it begins, and refused where there is less.

use fe_grid::Grid;

use crate::error::CliError;
use crate::grid::in_words;
use crate::processes;
use crate::progress::Progress;
use shapespace_input::bytes::format_bytes;
use shapespace_input::memory;

/// Notes how much memory a computation on a grid needs on this process, by an estimate of all its arrays.
///
/// # Errors
/// [`CliError::TooLarge`] if less is free.
pub(crate) fn announce<const D: usize>(
    needed: u64,
    grid: &Grid<D>,
    progress: &Progress,
) -> Result<(), CliError> {
    progress.note(in_short(needed));
    check_free(needed, grid)
}

/// Checks that so much memory is free on this process.
///
/// # Errors
/// [`CliError::TooLarge`] if less is free.
pub(crate) fn check_free<const D: usize>(needed: u64, grid: &Grid<D>) -> Result<(), CliError> {
    match free() {
        Some(free) if needed > free => Err(CliError::TooLarge {
            needed,
            free,
            nodes: in_words(grid),
        }),
        _ => Ok(()),
    }
}

/// The share of this process in the free memory, if the system states it.
pub(crate) fn free() -> Option<u64> {
    Some(memory::free()? / processes::on_this_machine())
}

/// How an estimate reads.
pub(crate) fn in_short(needed: u64) -> String {
    format!("memory: about {}", format_bytes(needed))
}
