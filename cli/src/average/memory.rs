//! Memory of an average: the estimate, and temporary files beyond the limit.

use std::path::{Path, PathBuf};

use fe_grid::{Distribution, Grid, Storage};
use shape_average::{AverageParams, MemoryEstimate, memory_estimate};

use super::args::AverageRun;
use crate::error::CliError;
use crate::grid::in_words;
use crate::memory::{free, in_short};
use crate::progress::Progress;
use shapespace_input::bytes::format_bytes;

/// Estimates and prints the memory of an average on this process, and moves data beyond `--memory`, or
/// else beyond its share of the free memory, to temporary files.
///
/// # Errors
/// [`CliError::Memory`] if that does not suffice.
pub(super) fn provide<const D: usize>(
    params: &mut AverageParams,
    distribution: &Distribution,
    n_components: usize,
    partly_visible: bool,
    grid: Grid<D>,
    run: &AverageRun,
    progress: &Progress,
) -> Result<MemoryEstimate, CliError> {
    let estimate = |params: &AverageParams| {
        memory_estimate(params, distribution, n_components, partly_visible, &grid)
    };
    let mut needed = estimate(params);
    let limit = run.memory.or_else(free);
    if let Some(limit) = limit
        && needed.memory > limit
    {
        params.storage = Storage::Folder(folder(&run.common.output));
        needed = estimate(params);
        if needed.memory > limit {
            params.remakes_metrics = true;
            needed = estimate(params);
        }
        if needed.memory > limit {
            return Err(CliError::Memory {
                limit,
                needed: needed.memory,
                shapes: distribution.n_parts(),
                nodes: in_words(&grid),
            });
        }
    }
    progress.note(describe(&needed, &params.storage));
    Ok(needed)
}

fn describe(estimate: &MemoryEstimate, storage: &Storage) -> String {
    let needed = in_short(estimate.memory);
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
