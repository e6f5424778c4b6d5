//! What of the work is kept between runs.
//!
//! As long as not all paths are computed, the result directory is `DIR.partial`, of which
//! [`Fingerprint`] says what it depends on. It holds `pairs/START_END.json` for every pair that is
//! finished. What is made of the paths afterwards (clusters, classes, whether both directions count)
//! may be chosen anew.

use std::path::PathBuf;

use super::args::DistancesConfig;
use super::pair::PairRecord;
use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::input::Image;
use crate::output::{OutputError, WorkDir};

const PAIRS: &str = "pairs";

/// What paths depend on.
pub(super) fn fingerprint<const D: usize>(
    config: &DistancesConfig,
    images: &[Image<D>],
) -> Fingerprint {
    let mut fingerprint = Fingerprint::new(config, images.iter().map(hash).collect());
    for afterwards in ["one_way", "linkage", "clusters", "classes"] {
        fingerprint.leave_out(afterwards);
    }
    // Without a second attempt, what counts as reached is asked afterwards only.
    if config.retry.is_none() {
        fingerprint.leave_out("reached");
    }
    fingerprint
}

/// The pairs that are kept.
#[derive(Debug)]
pub(super) struct Store(WorkDir);

impl Store {
    /// Begins a result directory, or goes on with one.
    ///
    /// # Errors
    /// Those of [`Fingerprint::work_dir`].
    pub fn open(target: &std::path::Path, fingerprint: &Fingerprint) -> Result<Self, CliError> {
        let work = fingerprint.work_dir(target)?;
        work.folder(PAIRS)?;
        Ok(Self(work))
    }

    /// The pair, if it is finished.
    pub fn pair(&self, ids: [usize; 2]) -> Option<PairRecord> {
        let record: PairRecord = self.0.get(name(ids))?;
        ([record.start, record.end] == ids).then_some(record)
    }

    /// Keeps a finished pair.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn keep(&self, record: &PairRecord) -> Result<(), OutputError> {
        self.0.put(name([record.start, record.end]), record)
    }

    /// The directory.
    pub fn directory(&self) -> &WorkDir {
        &self.0
    }

    /// The directory, to be named.
    pub fn into_directory(self) -> WorkDir {
        self.0
    }
}

fn name([start, end]: [usize; 2]) -> PathBuf {
    PathBuf::from(PAIRS).join(format!("{start:03}_{end:03}.json"))
}
