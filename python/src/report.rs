//! Errors as exceptions, with the text of the report that the command line prints.

use pyo3::prelude::*;
use shapespace::api::CliError;

/// The exception for an error: `shapespace.ShapespaceError`, or one of its kinds.
pub fn exception(py: Python<'_>, error: &CliError) -> PyErr {
    let made = py.import("shapespace._errors").and_then(|module| {
        let report = (error.causes(), error.help(), error.exit() as u8);
        module.getattr("of_report")?.call1(report)
    });
    match made {
        Ok(value) => PyErr::from_value(value),
        Err(failure) => failure,
    }
}
