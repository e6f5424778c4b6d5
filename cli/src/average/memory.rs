//! Room for an average: how much it needs, and temporary files where memory is short.

use std::path::{Path, PathBuf};

use fe_grid::{Grid, Storage};
use shape_average::{AverageParams, MemoryEstimate, memory_estimate};

use crate::args::AverageArgs;
use crate::error::CliError;
use crate::progress::Progress;

/// Estimates what an average needs, tells it, and sends to temporary files what does not fit
/// into `--memory`.
///
/// # Errors
/// [`CliError::Memory`] where that does not suffice.
pub(super) fn provide<const D: usize>(
    params: &mut AverageParams,
    n_shapes: usize,
    partly_seen: bool,
    grid: Grid<D>,
    args: &AverageArgs,
    progress: &Progress,
) -> Result<MemoryEstimate, CliError> {
    let mut estimate = memory_estimate(params, n_shapes, partly_seen, &grid);
    if let Some(limit) = args.memory
        && estimate.memory > limit
    {
        params.storage = Storage::Folder(folder(&args.common.output));
        estimate = memory_estimate(params, n_shapes, partly_seen, &grid);
        if estimate.memory > limit {
            return Err(CliError::Memory {
                limit,
                needed: estimate.memory,
                shapes: n_shapes,
                nodes: grid.nodes_per_axis()[0],
            });
        }
    }
    progress.note(describe(&estimate, &params.storage));
    if let Some(free) = free_memory()
        && estimate.memory > free
    {
        progress.note(format!(
            "warning: only {} of memory are free; try --memory {}, or a coarser --grid",
            format_bytes(free),
            format_bytes(free).replace(' ', "")
        ));
    }
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

/// Where temporary files lie: in the folder that the environment names for them, or beside the
/// output.
fn folder(output: &Path) -> PathBuf {
    if let Some(folder) = std::env::var_os("TMPDIR").filter(|folder| !folder.is_empty()) {
        return folder.into();
    }
    match output.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.into(),
        _ => ".".into(),
    }
}

/// The memory that programs can have without others being pushed out, where the system tells
/// (Linux).
fn free_memory() -> Option<u64> {
    let information = std::fs::read_to_string("/proc/meminfo").ok()?;
    let mut lines = information.lines();
    let line = lines.find(|line| line.starts_with("MemAvailable:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024 * kib)
}

/// Names of quantities of bytes, and how many they are.
const UNITS: [(&str, f64); 13] = [
    ("tib", 1_099_511_627_776.0),
    ("gib", 1_073_741_824.0),
    ("mib", 1_048_576.0),
    ("kib", 1024.0),
    ("tb", 1e12),
    ("gb", 1e9),
    ("mb", 1e6),
    ("kb", 1e3),
    ("t", 1_099_511_627_776.0),
    ("g", 1_073_741_824.0),
    ("m", 1_048_576.0),
    ("k", 1024.0),
    ("b", 1.0),
];

/// Reads a quantity of bytes: `4GiB`, `500 MB`, `2g`, `1000000`.
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let lower = text.trim().to_ascii_lowercase();
    let (number, unit) = UNITS
        .iter()
        .find_map(|(name, unit)| Some((lower.strip_suffix(name)?, *unit)))
        .unwrap_or((&lower, 1.0));
    let number: f64 = number
        .trim_end()
        .parse()
        .map_err(|_| "a number of bytes is needed, such as 4GiB or 500MB".to_string())?;
    let bytes = number * unit;
    if bytes >= 1.0 && bytes < 2f64.powi(63) {
        Ok(bytes as u64)
    } else {
        Err("at least one byte, and fewer than 8 million TiB".into())
    }
}

/// A quantity of bytes in words.
pub(crate) fn format_bytes(bytes: u64) -> String {
    let size = bytes as f64;
    let mib = 1_048_576.0;
    if size >= 1024.0 * mib {
        format!("{:.1} GiB", size / (1024.0 * mib))
    } else {
        format!("{:.0} MiB", (size / mib).ceil())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_of_bytes_are_read() {
        for (text, expected) in [
            ("4GiB", 4 << 30),
            ("1.5 gib", 3 << 29),
            ("500MB", 500_000_000),
            ("2g", 2 << 30),
            ("64k", 65536),
            ("100", 100),
            ("7 B", 7),
        ] {
            assert_eq!(bytes(text), Ok(expected), "{text}");
        }
        for wrong in ["", "GiB", "-1GB", "nan", "inf", "0", "4 gigs", "1e40", "1x"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_is_written_can_be_read() {
        for size in [1 << 20, 300 << 20, 5 << 30] {
            assert_eq!(bytes(&format_bytes(size).replace(' ', "")), Ok(size));
        }
    }
}
