//! Runs experiments in parallel.

use std::time::Instant;

use rayon::prelude::*;

use crate::error::ExperimentError;
use crate::record::{StatementRecord, VerifyRecord};
use crate::statement::{Setting, Statement};
use crate::verdict::Verdict;

/// Runs the experiments of statements on the threads of the current pool; `ended` is called after
/// each.
///
/// # Errors
/// [`ExperimentError`] if one of them fails. A statement that is refuted is no error.
pub fn run(
    statements: &[Statement],
    setting: Setting,
    ended: &(dyn Fn(&StatementRecord) + Sync),
) -> Result<VerifyRecord, ExperimentError> {
    let begun = Instant::now();
    let records = statements
        .par_iter()
        // Some take a thousand times as long as others.
        .with_max_len(1)
        .map(|statement| {
            let record = tried(statement, setting)?;
            ended(&record);
            Ok(record)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let seconds = begun.elapsed().as_secs_f64();
    Ok(VerifyRecord::new(setting, records, seconds))
}

/// Runs one experiment.
fn tried(statement: &Statement, setting: Setting) -> Result<StatementRecord, ExperimentError> {
    let begun = Instant::now();
    let outcome = (statement.run)(setting).map_err(|source| ExperimentError {
        name: statement.name,
        source,
    })?;
    let verdict = Verdict::of(&outcome, setting.ingredient);
    let seconds = begun.elapsed().as_secs_f64();
    Ok(StatementRecord::new(
        statement, setting, &outcome, &verdict, seconds,
    ))
}
