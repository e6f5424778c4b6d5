//! The experiments of `shapespace verify`.

use std::path::{Path, PathBuf};

use serde_json::Value;
use shapespace_verify::record::{StatementRecord, VerifyRecord};
use shapespace_verify::{Journal, Outcome, Setting, table};

use super::call::Stop;
use crate::error::CliError;
use crate::output::{OutputError, ResultDir};
use crate::progress::{Event, Listener};
use crate::verify::{selected, tried, write_all};

/// Which experiments are run, and how.
#[derive(Clone, Default)]
pub struct Trial {
    /// Statements by name or theme; all without.
    pub names: Vec<String>,
    /// Smaller experiments.
    pub quick: bool,
    /// With a broken ingredient, so that each statement has to be refuted.
    pub broken: bool,
    /// Number of threads, all cores without.
    pub threads: Option<u32>,
    /// Hears how each experiment ended.
    pub listener: Option<Listener>,
    /// Ends the work: no other experiment begins.
    pub stop: Stop,
}

/// Tells of experiments, and stops them.
struct Hearing<'a>(&'a Trial);

impl Journal for Hearing<'_> {
    fn is_stopped(&self) -> bool {
        self.0.stop.is_asked()
    }

    fn ended(&self, record: &StatementRecord, _outcome: &Outcome) {
        if let Some(listener) = &self.0.listener {
            let (word, name) = (record.decided.word(), &record.name);
            listener(Event::Note(format!("{word} {name}")));
        }
    }
}

/// The results of experiments.
pub struct Verified {
    record: VerifyRecord,
    json: Value,
}

impl Trial {
    /// Runs the experiments.
    ///
    /// # Errors
    /// [`CliError`] for unknown names, experiments that fail, and work that was asked to end. A refuted statement is a result.
    pub fn run(&self) -> Result<Verified, CliError> {
        let statements = selected(&self.names)?;
        let setting = Setting::new(self.quick, self.broken);
        let record = tried(&statements, setting, self.threads, &Hearing(self))?;
        if record.statements.len() < statements.len() {
            return Err(CliError::Stopped);
        }
        let failed = |error: serde_json::Error| OutputError::at(Path::new("result"))(error.into());
        let json = serde_json::to_value(&record).map_err(failed)?;
        Ok(Verified { record, json })
    }
}

impl Verified {
    /// The contents of `result.json`.
    pub fn record(&self) -> &Value {
        &self.json
    }

    /// Whether every statement holds, or, with a broken ingredient, is refuted.
    pub fn is_well(&self) -> bool {
        self.record.is_well()
    }

    /// The table of the command line.
    pub fn table(&self) -> String {
        table::plain(&self.record)
    }

    /// Writes the result directory of the command line.
    ///
    /// # Errors
    /// [`CliError::Output`], for example where the directory exists.
    pub fn save(&self, target: &Path) -> Result<PathBuf, CliError> {
        let directory = ResultDir::create(target)?;
        write_all(&directory, &self.record)?;
        Ok(directory.commit()?)
    }
}
