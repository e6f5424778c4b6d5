//! `shapespace verify` from the options to the directory.

use std::fs;
use std::time::Instant;

use rayon::prelude::*;

use super::args::VerifyArgs;
use super::experiments;
use super::plots::write_plots;
use super::record::{StatementRecord, VerifyRecord, write_tables};
use super::report::write_report;
use super::select::select;
use super::statement::{Effort, Ingredient, Setting, Statement};
use super::table;
use super::verdict::Verdict;
use crate::error::{CliError, Exit};
use crate::output::{OutputError, ResultDir, write_json};
use crate::pool::in_pool;

/// Tries statements, and writes what comes of it.
///
/// # Errors
/// [`CliError`] for names that there are not, outputs that cannot be written, and experiments that
/// cannot be made. A statement that is refuted is no error but [`Exit::Failure`]; so is a broken one
/// that is not.
pub fn run_verify(args: &VerifyArgs) -> Result<Exit, CliError> {
    let statements = select(experiments::all(), &args.names)?;
    let Some(output) = args.output.as_ref().filter(|_| !args.list) else {
        print!("{}", table::list(&statements));
        return Ok(Exit::Success);
    };
    let directory = ResultDir::create(output)?;
    let setting = Setting {
        effort: if args.quick {
            Effort::Quick
        } else {
            Effort::Full
        },
        ingredient: if args.broken {
            Ingredient::Broken
        } else {
            Ingredient::Sound
        },
    };
    let begun = Instant::now();
    let statements = in_pool(args.threads, || {
        statements
            .par_iter()
            // Some take a thousand times as long as others.
            .with_max_len(1)
            .map(|statement| tried(statement, setting))
            .collect::<Result<Vec<_>, _>>()
    })?;
    let record = VerifyRecord::new(setting, statements, begun.elapsed().as_secs_f64());
    write_json(&directory.file("result.json"), &record)?;
    let text = table::markdown(&record);
    let path = directory.file("table.md");
    fs::write(&path, &text).map_err(OutputError::at(&path))?;
    write_tables(&directory, &record)?;
    let plots = write_plots(&directory, &record)?;
    write_report(&directory.file("report.html"), &record, &plots)?;
    let target = directory.commit()?;
    print!("{}", table::plain(&record));
    eprintln!(
        "{}; report in {}",
        record.summary(),
        target.join("report.html").display()
    );
    Ok(if record.is_well() {
        Exit::Success
    } else {
        Exit::Failure
    })
}

/// Makes one experiment, and says on standard error how it ended.
fn tried(statement: &Statement, setting: Setting) -> Result<StatementRecord, CliError> {
    let begun = Instant::now();
    let outcome = (statement.run)(setting).map_err(|error| CliError::Computation {
        message: format!(
            "the experiment '{}' cannot be made: {error}",
            statement.name
        ),
        remedy: "please report this; the other statements can be named on the command line".into(),
    })?;
    let verdict = Verdict::of(&outcome, setting.ingredient);
    let seconds = begun.elapsed().as_secs_f64();
    eprintln!("{:<11} {} ({seconds:.1} s)", verdict.word(), statement.name);
    Ok(StatementRecord::new(
        statement, setting, &outcome, &verdict, seconds,
    ))
}
