//! `shapespace geodesic --error-bars`: the path again with fewer steps and on coarser grids, and what that says about
//! the errors of its length and dissipation.

use ::geodesic::{Geodesic, GeodesicError, GeodesicParams, Shape, geodesic_near};
use fe_grid::Grid;
use serde::Serialize;
use shapespace_report::error_bar::ErrorBar;

use crate::checkpoint::Checkpointer;
use crate::error::CliError;
use crate::grid::longest;
use crate::session::Session;
use crate::summary::Summary;

/// Most grids, and numbers of steps; three give an order of convergence.
const VALUES: usize = 3;
/// Fewest nodes along the longest side of a grid that is used.
const LEAST_NODES: usize = 17;
/// The order in the number of steps where it is not observed: that of a path in one direction.
const ORDER_OF_STEPS: f64 = 1.0;
/// The order in the spacing where it is not observed. Boundaries that are matched in strips as wide as cells cause errors
/// of first order.
const ORDER_OF_GRIDS: f64 = 1.0;

/// The error bars of a path.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ErrorBars {
    /// From paths of fewer steps; none of an odd number of steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    steps: Option<Series>,
    /// From paths on coarser grids; none of a coarse grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    grids: Option<Series>,
    /// Seconds for these paths.
    seconds: f64,
}

/// The figures of a path whose discretisation becomes coarser.
#[derive(Clone, Debug, Serialize)]
struct Series {
    /// Numbers of steps, or of nodes along the longest side, the finest first.
    of: Vec<usize>,
    length: ErrorBar,
    dissipation: ErrorBar,
}

/// The figures of paths, the finest first.
struct Found {
    of: Vec<usize>,
    lengths: Vec<f64>,
    dissipations: Vec<f64>,
}

impl Found {
    fn of<const D: usize>(fineness: usize, path: &Geodesic<D>) -> Self {
        let mut found = Self {
            of: Vec::new(),
            lengths: Vec::new(),
            dissipations: Vec::new(),
        };
        found.add(fineness, path);
        found
    }

    fn add<const D: usize>(&mut self, fineness: usize, path: &Geodesic<D>) {
        self.of.push(fineness);
        self.lengths.push(path.length());
        self.dissipations.push(path.dissipation());
    }

    /// `None` of a single path.
    fn series(self, order: f64) -> Option<Series> {
        Some(Series {
            length: ErrorBar::of(&self.lengths, order)?,
            dissipation: ErrorBar::of(&self.dissipations, order)?,
            of: self.of,
        })
    }
}

/// Computes paths of half and a quarter of the steps, and on grids of twice and four times the spacing, each from the one
/// before, so that all are in one valley. Those that do not arrive, and grids on which a shape is lost, are left out, with
/// what is coarser.
///
/// # Errors
/// Those of paths.
pub(super) fn error_bars<const D: usize>(
    path: &Geodesic<D>,
    [start, end]: [&Shape<D>; 2],
    params: &GeodesicParams,
    checkpointer: &mut Checkpointer<'_>,
    session: &Session<'_>,
) -> Result<ErrorBars, CliError> {
    let begin = std::time::Instant::now();
    let mut near = |what: String, known: &Geodesic<D>, ends: [&Shape<D>; 2], params: &_| {
        session.progress.note(format!("error bars, {what}:"));
        let mut watch = checkpointer.observe(session.observer(&[*ends[0].grid()]));
        let found = geodesic_near(ends[0], ends[1], known, params, &mut watch);
        watch.finish();
        let found = match found {
            // A shape that lies between the nodes.
            Err(GeodesicError::Degenerate { .. }) => None,
            found => found?,
        };
        let whole = found.filter(|path| path.end_reached() && !session.interrupt.asked());
        Ok::<_, CliError>(whole)
    };
    let mut of_steps = Found::of(params.steps, path);
    let (mut known, mut steps) = (None, params.steps);
    while of_steps.of.len() < VALUES && steps.is_multiple_of(2) {
        steps /= 2;
        let fewer = GeodesicParams {
            steps,
            ..params.clone()
        };
        let known_path = known.as_ref().unwrap_or(path);
        let Some(found) = near(format!("{steps} steps"), known_path, [start, end], &fewer)? else {
            break;
        };
        of_steps.add(steps, &found);
        known = Some(found);
    }
    let mut grid = *start.grid();
    let mut of_grids = Found::of(longest(&grid), path);
    known = None;
    while of_grids.of.len() < VALUES && !session.interrupt.asked() {
        let Some(coarser) = coarser(&grid) else { break };
        grid = coarser;
        let on_grid = |shape: &Shape<D>| {
            let components = shape.components().iter().map(|u| u.on_grid(&grid));
            Shape::of_components(components.collect())
        };
        let (start, end) = (on_grid(start)?, on_grid(end)?);
        let known_path = known.as_ref().unwrap_or(path);
        let what = format!("{} nodes a side", longest(&grid));
        let Some(found) = near(what, known_path, [&start, &end], params)? else {
            break;
        };
        of_grids.add(longest(&grid), &found);
        known = Some(found);
    }
    Ok(ErrorBars {
        steps: of_steps.series(ORDER_OF_STEPS),
        grids: of_grids.series(ORDER_OF_GRIDS),
        seconds: begin.elapsed().as_secs_f64(),
    })
}

/// The grid of twice the spacing, if paths on it are of use.
fn coarser<const D: usize>(grid: &Grid<D>) -> Option<Grid<D>> {
    grid.coarser().filter(|grid| longest(grid) >= LEAST_NODES)
}

impl ErrorBars {
    /// Adds lines about them to a summary.
    pub fn add_to(&self, summary: &mut Summary) {
        for (series, unit) in [(&self.steps, "steps"), (&self.grids, "nodes a side")] {
            let Some(series) = series else { continue };
            let of: Vec<String> = series.of.iter().map(usize::to_string).collect();
            summary.line("errors", format!("from {} {unit}", of.join(", ")));
            summary.line("", format!("length {}", series.length));
            summary.line("", format!("dissipation {}", series.dissipation));
        }
    }
}
