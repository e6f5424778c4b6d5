//! Outcomes of experiments in `DIR.partial`, from which a run goes on that was ended.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use shapespace_input::terminal::note;
use shapespace_verify::record::StatementRecord;
use shapespace_verify::{Journal, Outcome};

use super::args::VerifyArgs;
use crate::error::CliError;
use crate::fingerprint::Fingerprint;
use crate::output::WorkDir;

const STATEMENTS: &str = "statements";

/// What outcomes depend on, besides the version of the program.
#[derive(Serialize)]
struct Setting {
    quick: bool,
    broken: bool,
}

/// The outcome of an experiment.
#[derive(Serialize, Deserialize)]
struct Kept {
    seconds: f64,
    /// The program that it is of.
    build: String,
    outcome: Outcome,
}

/// The stored outcomes.
pub(super) struct Outcomes {
    work: WorkDir,
    /// The present program: outcomes of another build are none of this one.
    build: String,
}

impl Outcomes {
    /// Opens those of the same experiments, if there are any.
    ///
    /// # Errors
    /// Those of [`Fingerprint::work_dir`].
    pub fn open(target: &Path, args: &VerifyArgs) -> Result<Self, CliError> {
        let setting = Setting {
            quick: args.quick,
            broken: args.broken,
        };
        let work = Fingerprint::new(&setting, Vec::new()).work_dir(target)?;
        if work.file(STATEMENTS).is_dir() {
            note(format!(
                "going on from the outcomes in '{}'",
                work.path().display()
            ));
        }
        work.folder(STATEMENTS)?;
        let build = build();
        Ok(Self { work, build })
    }

    /// Removes them.
    ///
    /// # Errors
    /// Those of [`WorkDir::remove`].
    pub fn remove(self) -> Result<(), CliError> {
        Ok(self.work.remove()?)
    }
}

impl Journal for Outcomes {
    fn known(&self, statement: &str) -> Option<(Outcome, f64)> {
        let kept: Kept = self.work.get(name(statement))?;
        (kept.build == self.build).then_some((kept.outcome, kept.seconds))
    }

    fn ended(&self, record: &StatementRecord, outcome: &Outcome) {
        note(format!(
            "{:<11} {} ({:.1} s)",
            record.decided.word(),
            record.name,
            record.seconds
        ));
        let kept = Kept {
            seconds: record.seconds,
            build: self.build.clone(),
            outcome: outcome.clone(),
        };
        // Numbers that are not finite cannot be stored, and a disk may be full: such an experiment is
        // repeated after an interruption.
        let _ = self.work.put(name(record.name), &kept);
    }
}

/// The file of a statement.
fn name(statement: &str) -> PathBuf {
    PathBuf::from(STATEMENTS).join(format!("{statement}.json"))
}

/// Size and time of the program.
fn build() -> String {
    let metadata = std::env::current_exe().and_then(std::fs::metadata);
    let of = |metadata: std::fs::Metadata| {
        let time = metadata.modified().ok()?;
        let time = time.duration_since(std::time::UNIX_EPOCH).ok()?;
        Some(format!("{} bytes of {}", metadata.len(), time.as_millis()))
    };
    metadata.ok().and_then(of).unwrap_or_default()
}
