//! Memory of an average: the estimate, and temporary files beyond the limit.

use std::path::{Path, PathBuf};

use fe_grid::{Grid, Storage};
use shape_average::{AverageParams, MemoryEstimate, memory_estimate};

use super::args::AverageRun;
use crate::error::CliError;
use crate::grid::in_words;
use crate::progress::Progress;
use shapespace_input::bytes::format_bytes;
use shapespace_input::memory;

/// Estimates and prints the memory of an average, and moves data beyond `--memory`, or else beyond
/// the free memory, to temporary files.
///
/// # Errors
/// [`CliError::Memory`] if that does not suffice.
pub(super) fn provide<const D: usize>(
    params: &mut AverageParams,
    n_shapes: usize,
    partly_visible: bool,
    grid: Grid<D>,
    run: &AverageRun,
    progress: &Progress,
) -> Result<MemoryEstimate, CliError> {
    let mut estimate = memory_estimate(params, n_shapes, partly_visible, &grid);
    let limit = run.memory.or_else(memory::free);
    if let Some(limit) = limit
        && estimate.memory > limit
    {
        params.storage = Storage::Folder(folder(&run.common.output));
        estimate = memory_estimate(params, n_shapes, partly_visible, &grid);
        if estimate.memory > limit {
            return Err(CliError::Memory {
                limit,
                needed: estimate.memory,
                shapes: n_shapes,
                nodes: in_words(&grid),
            });
        }
    }
    progress.note(describe(&estimate, &params.storage));
    Ok(estimate)
}

fn describe(estimate: &MemoryEstimate, storage: &Storage) -> String {
    let needed = format!("memory: about {}", format_bytes(estimate.memory));
    match storage {
        Storage::Folder(folder) if estimate.files > 0 => format!(
            "{needed}, and {} in temporary files in '{}'",
            format_bytes(estimate.files),
            folder.display()
        ),
        _ => needed,
    }
}

/// The folder of temporary files: that of the environment variable, or the one of the output.
fn folder(output: &Path) -> PathBuf {
    if let Some(folder) = std::env::var_os("TMPDIR").filter(|folder| !folder.is_empty()) {
        return folder.into();
    }
    match output.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.into(),
        _ => ".".into(),
    }
}
