//! The log of a run for other programs: an object of JSON a line, on standard error.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use clap::ValueEnum;
use serde::Serialize;

use crate::error::{CliError, Exit};
use crate::progress::{Event, Listener};
use shapespace_input::terminal::note;

/// A format of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// A line for every event: an object with the keys `event` (`stage`, `iteration`, `note`, `result` or
    /// `error`) and `seconds` since the start, and others that `docs/formats.md` lists.
    Json,
}

/// A line of the log.
#[derive(Debug, Serialize)]
struct Line<'a> {
    /// Since the start of the run.
    seconds: f64,
    #[serde(flatten)]
    event: Entry<'a>,
}

/// What is logged.
#[derive(Debug, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
enum Entry<'a> {
    /// A stage has begun.
    Stage { text: &'a str },
    /// An iteration of a minimiser.
    Iteration {
        iteration: usize,
        evaluations: usize,
        #[serde(skip_serializing_if = "is_not_finite")]
        energy: f64,
    },
    /// A note, such as the work of a finished level, or a warning.
    Note { text: &'a str },
    /// The result has been written; always the last line, as an error is.
    Result {
        directory: &'a str,
        verdict: &'static str,
        doubts: usize,
        exit_code: u8,
    },
    /// There is no result.
    Error {
        message: &'a str,
        help: &'a str,
        exit_code: u8,
    },
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_not_finite(number: &f64) -> bool {
    !number.is_finite()
}

/// Writes a line of the log.
fn write(start: Instant, event: Entry<'_>) {
    let seconds = start.elapsed().as_secs_f64();
    // All values are texts and finite numbers.
    if let Ok(line) = serde_json::to_string(&Line { seconds, event }) {
        note(line);
    }
}

/// Logs the events of a run.
pub(crate) fn listener(start: Instant) -> Listener {
    Arc::new(move |event| {
        let entry = match &event {
            Event::Stage(text) => Entry::Stage { text },
            &Event::Iteration {
                iteration,
                evaluations,
                energy,
            } => Entry::Iteration {
                iteration,
                evaluations,
                energy,
            },
            Event::Note(text) => Entry::Note { text },
        };
        write(start, entry);
    })
}

/// Logs the end of a run, whose result has so many doubts.
pub(crate) fn result(start: Instant, directory: &Path, doubts: usize, exit: Exit) {
    write(
        start,
        Entry::Result {
            directory: &directory.to_string_lossy(),
            verdict: if doubts == 0 { "sound" } else { "doubtful" },
            doubts,
            exit_code: exit as u8,
        },
    );
}

/// Logs the error that ends a run.
pub(crate) fn error(start: Instant, error: &CliError) {
    write(
        start,
        Entry::Error {
            message: &error.causes().join(": "),
            help: &error.help(),
            exit_code: error.exit() as u8,
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn logged(event: Entry<'_>) -> Value {
        let line = Line {
            seconds: 0.5,
            event,
        };
        let text = serde_json::to_string(&line).unwrap();
        assert!(!text.contains('\n'), "{text}");
        serde_json::from_str(&text).unwrap()
    }

    #[test]
    fn a_line_is_an_object_with_its_event() {
        let text = "two\nlines";
        assert_eq!(
            logged(Entry::Note { text }),
            json!({"event": "note", "seconds": 0.5, "text": "two\nlines"})
        );
        let iteration = |energy| {
            logged(Entry::Iteration {
                iteration: 3,
                evaluations: 5,
                energy,
            })
        };
        assert_eq!(iteration(0.25)["energy"], 0.25);
        assert!(iteration(f64::NAN).get("energy").is_none());
        let error = logged(Entry::Error {
            message: "a",
            help: "b",
            exit_code: 2,
        });
        assert_eq!(
            (&error["event"], &error["exit_code"]),
            (&"error".into(), &2.into())
        );
    }
}
