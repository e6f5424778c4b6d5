//! Storage of finished pairs between runs.
//!
//! Until all paths are computed, the result directory is `DIR.partial`, with the [`Fingerprint`] of
//! the work. It holds `pairs/START_END.json` for every finished pair. The evaluation of the paths
//! afterwards (clusters, classes) may be chosen anew.

use std::path::{Path, PathBuf};

use super::args::DistancesConfig;
use super::pair::{Key, PairRecord};
use super::scope::Scope;
use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::grid::Sides;
use crate::output::{OutputError, WorkDir, unsealed};
use shapespace_input::Image;
use shapespace_input::files::read_text;

const PAIRS: &str = "pairs";

/// The inputs and parameters that paths depend on.
pub(super) fn fingerprint<const D: usize>(
    config: &DistancesConfig,
    scope: &Scope,
    images: &[Image<D>],
) -> Fingerprint {
    let mut fingerprint = Fingerprint::new(config, images.iter().map(hash).collect());
    // Which pairs are asked for does not matter for the path of a pair.
    for key in [
        "linkage",
        "clusters",
        "classes",
        "neighbours",
        "against",
        "skip_far",
        "landmarks",
        "detours",
    ] {
        fingerprint.leave_out(key);
    }
    // But for a box that fits all of them.
    let fits = config.masks.sides == Sides::Fit || config.masks.spacing.is_some();
    let (n, pairs) = (scope.n_shapes(), scope.possible());
    if fits && 2 * pairs.len() != n * (n - 1) {
        let text = format!("pairs {pairs:?}");
        fingerprint = fingerprint.and(std::iter::once(text));
    }
    // Without a second attempt, the threshold for complete paths is only used afterwards.
    if config.retry.is_none() {
        fingerprint.leave_out("reached");
    }
    fingerprint
}

/// The stored pairs.
#[derive(Debug)]
pub(super) struct Store(WorkDir);

impl Store {
    /// Creates a result directory, or resumes one.
    ///
    /// # Errors
    /// Those of [`Fingerprint::work_dir`].
    pub fn open(target: &std::path::Path, fingerprint: &Fingerprint) -> Result<Self, CliError> {
        let work = fingerprint.work_dir(target)?;
        work.folder(PAIRS)?;
        Ok(Self(work))
    }

    /// Takes those of these ways that are finished in the result directories of other runs, which have
    /// to have the same fingerprint; returns their number.
    ///
    /// # Errors
    /// Those of [`Store::keep`].
    pub fn merge(&self, directories: &[PathBuf], wanted: &[Key]) -> Result<usize, OutputError> {
        let mut taken = 0;
        for directory in directories {
            for &(ids, through) in wanted {
                let found = read_record(&directory.join(name(ids, through)), ids, through);
                if let Some(record) = found.filter(|_| self.pair(ids, through).is_none()) {
                    self.keep(&record)?;
                    taken += 1;
                }
            }
        }
        Ok(taken)
    }

    /// The paths from one shape to another, directly or from the way through a third one, if they are finished.
    pub fn pair(&self, ids: [usize; 2], through: Option<usize>) -> Option<PairRecord> {
        read_record(&self.0.file(name(ids, through)), ids, through)
    }

    /// Stores a finished pair.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn keep(&self, record: &PairRecord) -> Result<(), OutputError> {
        let name = name([record.start, record.end], record.through);
        self.0.put(name, record)
    }

    /// The error for an interruption before all requested pairs are finished.
    pub fn interrupted(&self, wanted: &[[usize; 2]]) -> CliError {
        let finished = wanted.iter().filter(|ids| self.pair(**ids, None).is_some());
        CliError::Unfinished {
            done: finished.count(),
            total: wanted.len(),
            path: self.0.path().into(),
        }
    }

    /// The directory, for what is stored beside the pairs.
    pub fn work(&self) -> &WorkDir {
        &self.0
    }

    /// The directory.
    pub fn into_directory(self) -> WorkDir {
        self.0
    }
}

/// The record of a pair in a file; none where there is no such file, or where it holds something else than was written.
fn read_record(path: &Path, ids: [usize; 2], through: Option<usize>) -> Option<PairRecord> {
    let record: PairRecord = unsealed(&read_text(path).ok()?)?;
    let is_it = [record.start, record.end] == ids && record.through == through;
    is_it.then_some(record)
}

fn name([start, end]: [usize; 2], through: Option<usize>) -> PathBuf {
    let through = through.map_or_else(String::new, |shape| format!("_through_{shape:03}"));
    PathBuf::from(PAIRS).join(format!("{start:03}_{end:03}{through}.json"))
}
