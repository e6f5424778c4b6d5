//! `shapespace average --starts`: minimisations from several starts, and the minima that they end in.

use fe_grid::minimise::Status;
use fe_grid::{Field, Grid, ScalarField};
use serde::Serialize;
use shape_average::{
    AverageParams, AverageResult, Minima, Minimum, Start, StartKind, average_from,
    doubts_of_minima, starts,
};

use crate::checkpoint::Checkpointer;
use crate::doubts::and_others;
use crate::error::CliError;
use crate::history::HistoryPoint;
use crate::report::word;
use crate::session::Session;
use crate::summary::Summary;
use levelset::{Cause, Doubt};

/// Minima listed on the terminal.
const LISTED: usize = 8;

/// The minima that were found.
#[derive(Clone, Debug, Serialize)]
pub(super) struct FoundMinima {
    /// How every start was made, in order. After an interruption there are fewer.
    pub starts: Vec<StartKind>,
    /// The lowest first.
    pub minima: Vec<Minimum>,
    /// Whether starts are missing.
    #[serde(skip)]
    pub interrupted: bool,
    /// How many starts were asked for.
    #[serde(skip)]
    pub asked: usize,
}

/// The shapes of an average, and where the usual start begins.
pub(super) struct Starting<'a, const D: usize> {
    pub distances: &'a [ScalarField<f64, D>],
    pub visibility: &'a [ScalarField<f64, D>],
    pub known: Vec<Field<f64, D, D>>,
}

/// Minimises from `n` starts; the first is the usual one. Returns the lowest result with its history.
///
/// # Errors
/// Those of averages and of checkpoints.
pub(super) fn lowest_of<const D: usize>(
    n: usize,
    shapes: Starting<'_, D>,
    params: &AverageParams,
    grids: &[Grid<D>],
    checkpointer: &mut Checkpointer<'_>,
    session: &Session<'_>,
) -> Result<(AverageResult<D>, Vec<HistoryPoint>, FoundMinima), CliError> {
    let (distances, visibility) = (shapes.distances, shapes.visibility);
    let mut all = starts(distances, params, n)?;
    if let Some(first) = all.first_mut() {
        first.displacements = shapes.known;
    }
    let mut minima = Minima::new(params);
    let (mut kinds, mut history, mut interrupted) = (Vec::new(), Vec::new(), false);
    for (i, start) in all.into_iter().enumerate() {
        let Start {
            kind,
            displacements,
            ..
        } = start;
        let name = word(&kind);
        let (progress, number) = (&session.progress, i + 1);
        progress.note(format!("start {number} of {n} ({name}):"));
        let mut watch = checkpointer.observe(session.observer(grids));
        let result = average_from(distances, visibility, &displacements, params, &mut watch)?;
        let own = watch.finish();
        interrupted = result
            .levels
            .last()
            .is_some_and(|level| level.status == Status::Cancelled);
        if interrupted && i > 0 {
            break;
        }
        kinds.push(kind);
        if minima.add(result)? {
            history = own;
        }
        interrupted = interrupted || number < n && session.interrupt.asked();
        if interrupted {
            break;
        }
    }
    let (result, minima) = minima
        .finish()?
        .ok_or(shape_average::AverageError::NoShapes)?;
    let found = FoundMinima {
        starts: kinds,
        minima,
        interrupted,
        asked: n,
    };
    Ok((result, history, found))
}

impl FoundMinima {
    /// The doubts about them; starts that are missing did not end in a minimum.
    pub fn doubts(&self) -> Vec<Doubt> {
        // Where the first was interrupted its result is, and there are no minima.
        let counts = self.interrupted && !self.minima.is_empty();
        let missing = if counts {
            self.asked - self.starts.len()
        } else {
            0
        };
        let unfinished = Doubt::check(Cause::NotConverged, missing as f64);
        let found = doubts_of_minima(&self.minima);
        unfinished.into_iter().chain(found).collect()
    }

    /// Adds a table to a summary.
    pub fn add_to(&self, summary: &mut Summary) {
        let (n, found) = (self.starts.len(), self.minima.len());
        let plural = if found == 1 { "minimum" } else { "minima" };
        let of = if self.interrupted {
            format!(" of {}", self.asked)
        } else {
            String::new()
        };
        summary.line("starts", format!("{n}{of} end in {found} {plural}"));
        summary.line(
            "",
            format!(
                "{:<13} {:<9} {:<11} {:<9} {:<8} starts",
                "energy", "excess", "curvature", "average", "points"
            ),
        );
        for (place, minimum) in self.minima.iter().take(LISTED).enumerate() {
            let curvature = minimum.least_eigenvalue.map_or_else(
                || "unknown".into(),
                |found| {
                    if found.is_saddle() {
                        "saddle".into()
                    } else if found.value < 0.0 {
                        // The model says so, and the functional does not.
                        "unclear".into()
                    } else {
                        format!("{:.3}", found.value)
                    }
                },
            );
            let average = match (place, minimum.other_shape) {
                (0, _) => "lowest",
                (_, true) => "other",
                (_, false) => "same",
            };
            let starts: Vec<String> = minimum.starts.iter().map(usize::to_string).collect();
            summary.line(
                "",
                format!(
                    "{:<13.6e} {:<9.3} {curvature:<11} {average:<9} {:<8.3} {}",
                    minimum.energy,
                    minimum.excess,
                    minimum.state_distance,
                    starts.join(",")
                ),
            );
        }
        if found > LISTED {
            summary.line("", and_others(found - LISTED));
        }
    }
}
