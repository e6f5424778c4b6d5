//! The summary of a result on standard output, and the exit code.

use std::fmt::Display;
use std::io::Write;
use std::path::Path;

use fe_grid::Certificate;

use crate::error::Exit;
use crate::report::{CANCELLED, RESULT, Record, certified};
use crate::shapes::describe_placement;

/// A short description of a result.
pub(crate) struct Summary {
    lines: Vec<String>,
    /// The status of the record.
    status: String,
    /// The file with the results.
    pub results: &'static str,
    /// The picture.
    picture: &'static str,
}

impl Summary {
    /// The summary of a record, with its first line and the name of its picture.
    pub fn new<C, T, const D: usize>(
        record: &Record<C, T, D>,
        picture: &'static str,
        title: String,
    ) -> Self {
        let mut summary = Self {
            lines: vec![title],
            status: record.status.clone(),
            results: RESULT,
            picture,
        };
        if let Some(alignment) = describe_placement(&record.input) {
            summary.line("alignment", alignment);
        }
        summary
    }

    /// Adds a line with a value; without a name, it continues the line above.
    pub fn line(&mut self, name: &str, value: impl Display) {
        self.lines.push(format!("  {name:<12} {value}"));
    }

    /// Adds text as it is.
    pub fn text(&mut self, text: impl Into<String>) {
        self.lines.push(text.into());
    }

    /// Adds a line about the deformations.
    pub fn certificate(&mut self, certificate: &Certificate) {
        let (state, det) = (certified(certificate), certificate.min_det);
        self.line(
            "deformation",
            format!("{state}, determinant at least {det:.3e}"),
        );
    }

    /// Prints the summary; the last line names the picture.
    pub fn print(mut self, directory: &Path) {
        self.line("results", directory.join(self.results).display());
        self.line("picture", directory.join(self.picture).display());
        // A closed standard output is not an error.
        let _ = writeln!(std::io::stdout(), "{}", self.lines.join("\n"));
    }

    /// The exit code of a command with this result.
    pub fn exit(&self) -> Exit {
        if self.status == CANCELLED {
            Exit::Interrupted
        } else {
            Exit::Success
        }
    }
}
