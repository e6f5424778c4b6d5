//! Minimisations from several starts, one after the other: of averages and of paths.

use serde::Serialize;
use shape_average::{Start, StartKind};

use crate::checkpoint::Checkpointer;
use crate::doubts::and_others;
use crate::error::CliError;
use crate::history::HistoryPoint;
use crate::report::word;
use crate::session::Session;
use crate::summary::Summary;
use fe_grid::Grid;
use fe_grid::minimise::{Curvature, Observer, Status};
use levelset::{Cause, Doubt};

/// Minima listed on the terminal.
const LISTED: usize = 8;

/// The curvature at a minimum, in a table.
pub(crate) fn curvature(found: Option<&Curvature>) -> String {
    match found {
        None => "unknown".into(),
        Some(found) if Doubt::saddle(found).is_some() => "saddle".into(),
        // The model says so, and the energy does not.
        Some(found) if found.value < 0.0 => "unclear".into(),
        Some(found) => format!("{:.3}", found.value),
    }
}

/// The minima that were found.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Found<M> {
    /// How every start was made, in order. After an interruption there are fewer.
    pub starts: Vec<StartKind>,
    /// That of the result first.
    pub minima: Vec<M>,
    /// Whether starts are missing.
    #[serde(skip)]
    pub interrupted: bool,
    /// How many starts were asked for.
    #[serde(skip)]
    pub asked: usize,
}

/// A minimisation from one start.
pub(crate) struct Run<R> {
    pub result: R,
    /// Whether it was interrupted.
    pub cancelled: bool,
}

/// Minimises from every start by `run`, until the first interruption, and gives the results to `keep`, which
/// says whether the result is the best so far. An interrupted one is given only if it is the first. Returns
/// what is known of the starts, without minima, and the history of the best.
///
/// # Errors
/// Those of `run` and of `keep`.
pub(crate) fn from_each<const D: usize, R>(
    all: Vec<Start<D>>,
    grids: &[Grid<D>],
    checkpointer: &mut Checkpointer<'_>,
    session: &Session<'_>,
    run: &dyn Fn(Start<D>, &mut dyn Observer) -> Result<Run<R>, CliError>,
    keep: &mut dyn FnMut(R) -> Result<bool, CliError>,
) -> Result<(Found<()>, Vec<HistoryPoint>), CliError> {
    let asked = all.len();
    let (mut starts, mut history, mut interrupted) = (Vec::new(), Vec::new(), false);
    for (i, start) in all.into_iter().enumerate() {
        let (kind, number) = (start.kind, i + 1);
        let name = word(&kind);
        let progress = &session.progress;
        progress.note(format!("start {number} of {asked} ({name}):"));
        let mut watch = checkpointer.observe(session.observer(grids));
        let Run { result, cancelled } = run(start, &mut watch)?;
        let own = watch.finish();
        interrupted = cancelled;
        if interrupted && i > 0 {
            break;
        }
        starts.push(kind);
        if keep(result)? {
            history = own;
        }
        interrupted = interrupted || number < asked && session.interrupt.asked();
        if interrupted {
            break;
        }
    }
    let found = Found {
        starts,
        minima: Vec::new(),
        interrupted,
        asked,
    };
    Ok((found, history))
}

impl Found<()> {
    /// With the minima.
    pub fn with<M>(self, minima: Vec<M>) -> Found<M> {
        Found {
            starts: self.starts,
            minima,
            interrupted: self.interrupted,
            asked: self.asked,
        }
    }
}

impl<M> Found<M> {
    /// The status of a result: cancelled where starts are missing, or else that of its last level.
    pub fn status(found: Option<&Self>, last: Option<Status>) -> Option<Status> {
        if found.is_some_and(|found| found.interrupted) {
            Some(Status::Cancelled)
        } else {
            last
        }
    }

    /// The doubt about starts that are missing, as they did not end in a minimum, and those about the minima.
    pub fn doubts(&self, of_minima: impl Fn(&[M]) -> Vec<Doubt>) -> Vec<Doubt> {
        // Where the first was interrupted its result is, and there are no minima.
        let counts = self.interrupted && !self.minima.is_empty();
        let missing = if counts {
            // The last one, where it ended and what follows did not.
            (self.asked - self.starts.len()).max(1)
        } else {
            0
        };
        let unfinished = Doubt::check(Cause::NotConverged, missing as f64);
        unfinished
            .into_iter()
            .chain(of_minima(&self.minima))
            .collect()
    }

    /// Adds a table to a summary: how many minima there are, in words for one and for several, and a row for
    /// each below the header.
    pub fn add_to(
        &self,
        summary: &mut Summary,
        [one, several]: [&str; 2],
        header: String,
        row: impl Fn(usize, &M) -> String,
    ) {
        let (n, found) = (self.starts.len(), self.minima.len());
        let noun = if found == 1 { one } else { several };
        let of = if self.interrupted {
            format!(" of {}", self.asked)
        } else {
            String::new()
        };
        summary.line("starts", format!("{n}{of} end in {found} {noun}"));
        summary.line("", header);
        for (place, minimum) in self.minima.iter().take(LISTED).enumerate() {
            summary.line("", row(place, minimum));
        }
        if found > LISTED {
            summary.line("", and_others(found - LISTED));
        }
    }
}

/// An excess of energy, without the sign of what rounds to zero.
pub(crate) fn rounded(excess: f64) -> String {
    let text = format!("{excess:.3}");
    if text == "-0.000" {
        "0.000".into()
    } else {
        text
    }
}

/// Numbers of starts, separated by commas.
pub(crate) fn numbers(starts: &[usize]) -> String {
    let starts: Vec<String> = starts.iter().map(usize::to_string).collect();
    starts.join(",")
}
