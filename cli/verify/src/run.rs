//! Runs experiments in parallel.

use std::time::Instant;

use rayon::prelude::*;

use crate::error::ExperimentError;
use crate::outcome::Outcome;
use crate::record::{StatementRecord, VerifyRecord};
use crate::statement::{Setting, Statement};
use crate::verdict::Verdict;

/// The outcomes of experiments, across several runs of the program.
pub trait Journal: Sync {
    /// The outcome of the experiment of a statement, and its wall time, if it is known.
    fn known(&self, statement: &str) -> Option<(Outcome, f64)> {
        let _ = statement;
        None
    }

    /// Whether no other experiment should begin.
    fn is_stopped(&self) -> bool {
        false
    }

    /// Called after every experiment.
    fn ended(&self, record: &StatementRecord, outcome: &Outcome) {
        let _ = (record, outcome);
    }
}

/// A journal that knows nothing, and keeps nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoJournal;

impl Journal for NoJournal {}

impl<F: Fn(&StatementRecord) + Sync> Journal for F {
    fn ended(&self, record: &StatementRecord, _outcome: &Outcome) {
        self(record);
    }
}

/// Runs the experiments of statements on the threads of the current pool, except for those whose outcomes
/// a journal has. Once the journal is stopped, no other begins, and the record has those that have ended.
///
/// # Errors
/// [`ExperimentError`] if one of them fails. A statement that is refuted is no error.
pub fn run(
    statements: &[Statement],
    setting: Setting,
    journal: &dyn Journal,
) -> Result<VerifyRecord, ExperimentError> {
    let begun = Instant::now();
    let records = statements
        .par_iter()
        // Some take a thousand times as long as others.
        .with_max_len(1)
        .map(|statement| {
            if journal.is_stopped() {
                return Ok(None);
            }
            let known = journal.known(statement.name);
            let is_new = known.is_none();
            let (outcome, seconds) = known.map_or_else(|| tried(statement, setting), Ok)?;
            let verdict = Verdict::of(&outcome, setting.ingredient);
            let record = StatementRecord::new(statement, setting, &outcome, &verdict, seconds);
            if is_new {
                journal.ended(&record, &outcome);
            }
            Ok(Some(record))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let records = records.into_iter().flatten().collect();
    let seconds = begun.elapsed().as_secs_f64();
    Ok(VerifyRecord::new(setting, records, seconds))
}

/// Runs one experiment; returns its wall time, too.
fn tried(statement: &Statement, setting: Setting) -> Result<(Outcome, f64), ExperimentError> {
    let begun = Instant::now();
    let outcome = (statement.run)(setting).map_err(|source| ExperimentError {
        name: statement.name,
        source,
    })?;
    Ok((outcome, begun.elapsed().as_secs_f64()))
}
