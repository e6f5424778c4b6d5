//! Calls of commands.

use std::path::PathBuf;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use shapespace::api::{COMMANDS, Call, Checkpoints, Trial};
use toml::Table;

use crate::arrays::{Given, sources};
use crate::report::exception;
use crate::result::{Computed, Verified};
use crate::wait::{Heard, wait};

/// The options of a call from JSON: a dictionary of numbers, texts and lists of them.
fn table(options: &str) -> PyResult<Table> {
    let wrong = |error: String| PyValueError::new_err(error);
    let values: serde_json::Value =
        serde_json::from_str(options).map_err(|error| wrong(error.to_string()))?;
    Table::try_from(values).map_err(|error| wrong(error.to_string()))
}

/// Runs a command on files and arrays.
#[pyfunction]
#[pyo3(signature = (command, options, arrays, *, config, checkpoint, threads, memory, at_once, trust, progress))]
#[expect(clippy::needless_pass_by_value, reason = "arguments of Python")]
pub fn run(
    py: Python<'_>,
    command: String,
    options: &str,
    arrays: Vec<Given<'_>>,
    config: Option<PathBuf>,
    checkpoint: Option<(PathBuf, f64)>,
    threads: Option<u32>,
    memory: Option<&str>,
    at_once: Option<u32>,
    trust: bool,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Computed> {
    let heard = Heard::default();
    let memory = memory.map(shapespace::api::memory).transpose();
    let memory = memory.map_err(|error| exception(py, &error))?;
    let call = Call {
        options: table(options)?,
        config,
        checkpoints: checkpoint.map(|(folder, minutes)| Checkpoints { folder, minutes }),
        sources: sources(py, arrays)?,
        threads,
        memory,
        at_once,
        trust,
        listener: progress.is_some().then(|| heard.listener()),
        ..Call::default()
    };
    let stop = call.stop.clone();
    let work = move || call.run(&command);
    let computed = wait(py, &heard, progress.as_ref(), || stop.ask(), work)?;
    computed
        .map(Computed::new)
        .map_err(|error| exception(py, &error))
}

/// Runs the experiments that check the theory.
#[pyfunction]
#[pyo3(signature = (names, *, quick, broken, threads, progress))]
#[expect(clippy::needless_pass_by_value, reason = "arguments of Python")]
pub fn verify(
    py: Python<'_>,
    names: Vec<String>,
    quick: bool,
    broken: bool,
    threads: Option<u32>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Verified> {
    let heard = Heard::default();
    let trial = Trial {
        names,
        quick,
        broken,
        threads,
        listener: progress.is_some().then(|| heard.listener()),
        ..Trial::default()
    };
    // An experiment that has begun ends by itself; no other begins.
    let stop = trial.stop.clone();
    let work = move || trial.run();
    let verified = wait(py, &heard, progress.as_ref(), || stop.ask(), work)?;
    verified
        .map(Verified::new)
        .map_err(|error| exception(py, &error))
}

/// The names of the commands.
#[pyfunction]
pub fn commands() -> Vec<&'static str> {
    COMMANDS.to_vec()
}

/// The options of a command.
#[pyfunction]
pub fn keys(py: Python<'_>, command: &str) -> PyResult<Vec<String>> {
    shapespace::api::keys(command).map_err(|error| exception(py, &error))
}
