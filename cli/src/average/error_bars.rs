//! `shapespace average --error-bars`: the average again on coarser grids, and what that says about the
//! errors of its figures.

use fe_grid::transfer::inject_into;
use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, Moments, contour};
use serde::Serialize;
use shape_average::{AverageError, AverageParams, AverageResult, average_of_visible};
use shapespace_report::error_bar::ErrorBar;

use crate::checkpoint::Checkpointer;
use crate::error::CliError;
use crate::grid::longest;
use crate::session::Session;
use crate::summary::Summary;

/// Most grids; three give an order of convergence.
const GRIDS: usize = 3;
/// Fewest nodes along the longest side of a grid that is used. On coarser ones interfaces, two spacings on both sides, fill
/// most of a shape.
const LEAST_NODES: usize = 17;
/// The order where it is not observed. Interfaces as wide as two spacings cause errors of first order.
const ASSUMED_ORDER: f64 = 1.0;

/// The error bars of an average, in length units of the unit box.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ErrorBars {
    /// Nodes along the longest side of all grids, the finest first.
    nodes: Vec<usize>,
    /// Seconds for the coarser grids.
    seconds: f64,
    /// The functional. Its error, and those of its parts, do not contain that of the minimisation, which
    /// `energy.remaining` estimates.
    total: ErrorBar,
    elastic: ErrorBar,
    mismatch: ErrorBar,
    length_term: ErrorBar,
    /// The stored energy of every shape.
    elastic_of_shapes: Vec<ErrorBar>,
    /// Area or volume of the average.
    volume: ErrorBar,
    /// Length or area of its boundary.
    boundary: ErrorBar,
    /// Distances of the farthest points of its boundary from its centroid.
    radius: ErrorBar,
}

/// The figures of an average on one grid, in the order of [`ErrorBars`]: the last are those of shapes.
fn figures<const D: usize>(result: &AverageResult<D>) -> Result<Vec<f64>, CliError> {
    let failed = AverageError::from;
    let outline = contour(&result.average_indicator, 0.5, BoxEdge::Closed).map_err(failed)?;
    let moments = Moments::of_contour(&outline).map_err(failed)?;
    let away = |p: &[f64; D]| {
        let squares = p
            .iter()
            .zip(&moments.centroid)
            .map(|(x, c)| (x - c).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let energy = &result.energy;
    let [elastic, mismatch, length] = energy.parts;
    let radius = outline.points().iter().map(away).fold(0.0, f64::max);
    let mut figures = vec![
        energy.total,
        elastic,
        mismatch,
        length,
        moments.volume,
        outline.perimeter(),
        radius,
    ];
    figures.extend(&energy.elastic);
    Ok(figures)
}

/// Computes the averages on coarser grids and the error bars of `result`, with these signed distances and
/// visibility masks. `None` where the coarser grids are too coarse, or the run was interrupted.
///
/// # Errors
/// Those of averages.
pub(super) fn error_bars<const D: usize>(
    result: &AverageResult<D>,
    mut distances: Vec<ScalarField<f64, D>>,
    mut seen: Vec<ScalarField<f64, D>>,
    params: &AverageParams,
    checkpointer: &mut Checkpointer<'_>,
    session: &Session<'_>,
) -> Result<Option<ErrorBars>, CliError> {
    let start = std::time::Instant::now();
    let mut grid = *result.average.grid();
    let mut nodes = vec![longest(&grid)];
    let mut found = vec![figures(result)?];
    while nodes.len() < GRIDS && !session.interrupt.asked() {
        let Some(coarser) = grid.coarser().filter(|g| longest(g) >= LEAST_NODES) else {
            break;
        };
        grid = coarser;
        let n = longest(&grid);
        session
            .progress
            .note(format!("error bars, {n} nodes a side:"));
        distances = coarsened(&grid, &distances);
        seen = coarsened(&grid, &seen);
        let grids = grid.hierarchy(params.coarsest_nodes);
        let mut watch = checkpointer.observe(session.observer(&grids));
        let average = average_of_visible(&distances, &seen, params, &mut watch);
        watch.finish();
        let average = match average {
            // A shape that lies between the nodes.
            Err(AverageError::Degenerate { .. }) => break,
            average => average?,
        };
        if session.interrupt.asked() {
            break;
        }
        nodes.push(n);
        found.push(figures(&average)?);
    }
    Ok(bars(nodes, start.elapsed().as_secs_f64(), &found))
}

/// The error bars of figures on grids of these nodes a side; `None` of a single grid.
fn bars(nodes: Vec<usize>, seconds: f64, found: &[Vec<f64>]) -> Option<ErrorBars> {
    let bar = |k: usize| {
        let values: Vec<f64> = found.iter().map(|figures| figures[k]).collect();
        ErrorBar::of(&values, ASSUMED_ORDER)
    };
    let shapes = 7..found.first()?.len();
    Some(ErrorBars {
        nodes,
        seconds,
        total: bar(0)?,
        elastic: bar(1)?,
        mismatch: bar(2)?,
        length_term: bar(3)?,
        volume: bar(4)?,
        boundary: bar(5)?,
        radius: bar(6)?,
        elastic_of_shapes: shapes.map(bar).collect::<Option<_>>()?,
    })
}

/// Values at the nodes of a coarser grid, which are nodes of the finer one.
fn coarsened<const D: usize>(
    grid: &Grid<D>,
    fields: &[ScalarField<f64, D>],
) -> Vec<ScalarField<f64, D>> {
    let of = |field: &ScalarField<f64, D>| {
        let mut coarse = ScalarField::zeros(*grid);
        inject_into(grid, field.as_slice(), coarse.as_mut_slice());
        coarse
    };
    fields.iter().map(of).collect()
}

impl ErrorBars {
    /// Adds lines about them to a summary.
    pub fn add_to(&self, summary: &mut Summary) {
        let nodes: Vec<String> = self.nodes.iter().map(usize::to_string).collect();
        summary.line(
            "errors",
            format!("from grids of {} nodes a side", nodes.join(", ")),
        );
        for (name, bar) in [
            ("elastic", &self.elastic),
            ("mismatch", &self.mismatch),
            ("volume", &self.volume),
            ("boundary", &self.boundary),
            ("radius", &self.radius),
        ] {
            summary.line("", format!("{name} {bar}"));
        }
    }
}
