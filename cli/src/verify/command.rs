//! `shapespace verify` from the options to the directory.

use std::{fs, io};

use shapespace_verify::record::{VerifyRecord, figures_csv, lines_csv};
use shapespace_verify::{
    Journal, Setting, Statement, UnknownStatement, experiments, plot, report, run, select, table,
};

use super::args::VerifyArgs;
use super::journal::Outcomes;
use crate::error::{CliError, Exit};
use crate::integrity::seal;
use crate::memory::in_short;
use crate::output::{OutputError, ResultDir, write_json, write_text};
use crate::pool::in_pool;
use crate::print::{print, print_or_note};
use shapespace_input::terminal::note;

/// What a run needs, in bytes: that of the largest experiments. A full run on two threads had 122 MiB, a quick one 41.
const MEMORY: u64 = 130 << 20;

/// Checks statements, and writes the results.
///
/// # Errors
/// [`CliError`] for unknown names, outputs that cannot be written, and experiments that fail. A
/// refuted statement is not an error but [`Exit::Failure`]; so is a broken one that is not refuted.
pub fn run_verify(args: &VerifyArgs) -> Result<Exit, CliError> {
    let statements = selected(&args.names)?;
    let Some(output) = args.output.as_ref().filter(|_| !args.list) else {
        print(&table::list(&statements))?;
        return Ok(Exit::Success);
    };
    let directory = ResultDir::create(output)?;
    note(in_short(MEMORY));
    let setting = Setting::new(args.quick, args.broken);
    let outcomes = Outcomes::open(output, args)?;
    let record = tried(&statements, setting, args.threads, &outcomes)?;
    write_all(&directory, &record)?;
    let target = directory.commit()?;
    outcomes.remove()?;
    print_or_note(&table::plain(&record));
    note(format!(
        "{}; report in {}",
        record.summary(),
        target.join("report.html").display()
    ));
    Ok(if record.is_well() {
        Exit::Success
    } else {
        Exit::Failure
    })
}

/// Runs the experiments of statements that a journal does not know.
///
/// # Errors
/// [`CliError::Computation`] for an experiment that fails.
pub(crate) fn tried(
    statements: &[Statement],
    setting: Setting,
    threads: Option<u32>,
    journal: &dyn Journal,
) -> Result<VerifyRecord, CliError> {
    in_pool(threads, || {
        run(statements, setting, journal).map_err(|error| CliError::Computation {
            message: error.to_string(),
            remedy: "please report this; the other statements can be named on the command line"
                .into(),
        })
    })
}

/// Writes all files of a result directory.
pub(crate) fn write_all(directory: &ResultDir, record: &VerifyRecord) -> Result<(), CliError> {
    write_json(&directory.file("result.json"), record)?;
    let folder = directory.file("plots");
    let failed = OutputError::at(&folder);
    let plots = plot::plots(record).map_err(|error| failed(io::Error::other(error)))?;
    fs::create_dir(&folder).map_err(failed)?;
    for plot in &plots {
        write_text(&folder.join(format!("{}.svg", plot.name)), &plot.svg)?;
    }
    for (name, text) in [
        ("table.md", table::markdown(record)),
        ("figures.csv", figures_csv(record)),
        ("lines.csv", lines_csv(record)),
        ("report.html", report::page(record, &plots)),
    ] {
        write_text(&directory.file(name), &text)?;
    }
    Ok(seal(directory)?)
}

/// The statements that are named.
pub(crate) fn selected(names: &[String]) -> Result<Vec<Statement>, CliError> {
    select(experiments::all(), names).map_err(|UnknownStatement { name, near }| CliError::Option {
        option: "NAME",
        value: name,
        remedy: format!(
            "similar names are {}; `shapespace verify --list` lists all statements",
            near.join(", ")
        ),
    })
}
