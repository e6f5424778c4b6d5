//! `shapespace average --starts`: minimisations from several starts, and the minima that they end in.

use fe_grid::minimise::Status;
use fe_grid::{Field, Grid, ScalarField};
use shape_average::{
    AverageError, AverageParams, AverageResult, Minima, Minimum, average_from, doubts_of_minima,
    starts,
};

use crate::checkpoint::Checkpointer;
use crate::error::CliError;
use crate::history::HistoryPoint;
use crate::session::Session;
use crate::starts::{Found, Run, curvature, from_each, numbers, rounded};
use crate::summary::Summary;
use levelset::Doubt;

/// The minima that were found, the lowest first.
pub(super) type FoundMinima = Found<Minimum>;

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
    let (found, history) = from_each(
        all,
        grids,
        checkpointer,
        session,
        &|start, watch| {
            let result = average_from(distances, visibility, &start.displacements, params, watch)?;
            let last = result.levels.last().map(|level| level.status);
            let cancelled = last == Some(Status::Cancelled);
            Ok(Run { result, cancelled })
        },
        &mut |result| Ok(minima.add(result)?),
    )?;
    let (result, minima) = minima.finish()?.ok_or(AverageError::NoShapes)?;
    Ok((result, history, found.with(minima)))
}

/// The doubts about the minima, and about starts that are missing.
pub(super) fn doubts(found: &FoundMinima) -> Vec<Doubt> {
    found.doubts(doubts_of_minima)
}

/// Adds a table to a summary.
pub(super) fn add_minima(summary: &mut Summary, found: &FoundMinima) {
    let header = format!(
        "{:<13} {:<9} {:<11} {:<9} {:<8} starts",
        "energy", "excess", "curvature", "average", "points"
    );
    found.add_to(summary, ["minimum", "minima"], header, |place, minimum| {
        let curvature = curvature(minimum.least_eigenvalue.as_ref());
        let average = match (place, minimum.other_shape) {
            (0, _) => "lowest",
            (_, true) => "other",
            (_, false) => "same",
        };
        format!(
            "{:<13.6e} {:<9} {curvature:<11} {average:<9} {:<8.3} {}",
            minimum.energy,
            rounded(minimum.excess),
            minimum.state_distance,
            numbers(&minimum.starts)
        )
    });
}
