//! The result of a call.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

use crate::error::CliError;
use crate::integrity::seal;
use crate::output::{Kept, KeptArray, OutputError, ResultDir, WorkDir};
use crate::page::write_page;
use crate::session::{Command, Session};
use crate::summary::Summary;

/// A result: its arrays, its record, and all that is needed to write its directory.
pub struct Computed {
    held: Box<dyn Writable>,
    /// Files that belong to the directory and have been written during the computation.
    work: Option<WorkDir>,
    kept: Kept,
    summary: String,
    interrupted: bool,
    /// The folder of the work.
    place: Option<TempDir>,
}

/// A command and its outcome.
pub(super) struct Held<C: Command, const D: usize> {
    pub command: C,
    pub outcome: C::Outcome<D>,
}

/// What can be written to a directory.
trait Writable: Send {
    fn write(&self, session: &Session<'_>, directory: &ResultDir) -> Result<(), CliError>;
}

impl<C: Command + Send, const D: usize> Writable for Held<C, D> {
    fn write(&self, session: &Session<'_>, directory: &ResultDir) -> Result<(), CliError> {
        let summary = self.command.write(&self.outcome, session, directory)?;
        Ok(write_page(directory, &summary, None)?)
    }
}

impl Computed {
    pub(super) fn new<C: Command + Send + 'static, const D: usize>(
        held: Held<C, D>,
        work: Option<WorkDir>,
        kept: Kept,
        summary: &Summary,
    ) -> Self {
        Self {
            held: Box::new(held),
            work,
            kept,
            summary: summary.words(),
            interrupted: summary.interrupted,
            place: None,
        }
    }

    pub(super) fn with_place(mut self, place: TempDir) -> Self {
        self.place = self.work.is_some().then_some(place);
        self
    }

    /// The arrays of the result directory.
    pub fn arrays(&self) -> &[KeptArray] {
        &self.kept.arrays
    }

    /// The same arrays, which are not kept any longer.
    pub fn take_arrays(&mut self) -> Vec<KeptArray> {
        std::mem::take(&mut self.kept.arrays)
    }

    /// The contents of `result.json`, without the checksums of files.
    pub fn record(&self) -> &Value {
        &self.kept.record
    }

    /// The summary of the command line, without the names of files.
    pub fn summary(&self) -> &str {
        &self.summary
    }

    /// Whether the caller has stopped the computation.
    pub fn interrupted(&self) -> bool {
        self.interrupted
    }

    /// Writes the result directory of the command line, or, not `drawn`, only the arrays and the
    /// record, from which other commands start.
    ///
    /// # Errors
    /// [`CliError::Output`], for example where the directory exists.
    pub fn save(&self, target: &Path, drawn: bool) -> Result<PathBuf, CliError> {
        let mut directory = ResultDir::create(target)?;
        if !drawn {
            directory = directory.without_pictures();
        }
        if let Some(work) = &self.work {
            copy(work.path(), directory.path()).map_err(OutputError::at(work.path()))?;
        }
        let seconds = self.kept.record["seconds"].as_f64().unwrap_or(0.0);
        let seconds = Duration::try_from_secs_f64(seconds).unwrap_or_default();
        let now = Instant::now();
        let session = Session {
            // The time of the computation, without what has passed since.
            start: now.checked_sub(seconds).unwrap_or(now),
            ..Session::alone(target)
        };
        self.held.write(&session, &directory)?;
        seal(&directory)?;
        Ok(directory.commit()?)
    }
}

/// Copies a folder with all that is in it, except for hidden files.
fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            fs::create_dir_all(&target)?;
            copy(&entry.path(), &target)?;
        } else if !entry.file_name().to_string_lossy().starts_with('.') {
            fs::copy(entry.path(), &target)?;
        }
    }
    Ok(())
}
