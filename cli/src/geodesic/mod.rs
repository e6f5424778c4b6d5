//! `shapespace geodesic`: computes the shortest path between two masks.
//!
//! `plan` reads and validates the inputs, `path` holds the boundaries and densities along the
//! result, `record` and `write` write the result directory, `draw` its pictures, `summary` the
//! summary.

mod args;
pub(crate) mod draw;
pub(crate) mod path;
mod plan;
mod record;
mod summary;
pub(crate) mod write;

use std::time::Instant;

use ::geodesic::{Form, Geodesic, GeodesicParams, Known, Shape, geodesic_between};
use fe_grid::{Grid, ScalarField};

use crate::error::{CliError, Exit};
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::shapes::{Components, Input, VisibilityMask, prepare, view_of};
use crate::watch::{HistoryPoint, Interrupt, ProgressObserver, level_nodes};

pub use args::{GeodesicArgs, GeodesicConfig, Occluded};
pub(crate) use args::{check_area, check_path};
pub use plan::{AnyPlan, GeodesicPlan, plan_geodesic};

/// The result of a computation.
struct Outcome<const D: usize> {
    /// Start and end.
    inputs: Vec<Input<D>>,
    config: GeodesicConfig,
    /// The labels of their components, if there are several.
    labels: Vec<i64>,
    result: Geodesic<D>,
    history: Vec<HistoryPoint>,
    start: Instant,
    /// Seconds of the minimisation.
    solver_seconds: f64,
}

/// Runs `shapespace geodesic`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_geodesic(args: &GeodesicArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    let compute = |config| {
        progress.stage("reading 2 masks");
        match plan_geodesic(config, &args.run.output)? {
            AnyPlan::D2(plan) => run_plan(plan, args, &progress, interrupt, start),
            AnyPlan::D3(plan) => run_plan(plan, args, &progress, interrupt, start),
        }
    };
    args.config
        .run(|config| in_pool(args.run.threads, || compute(config)))
}

fn run_plan<const D: usize>(
    plan: GeodesicPlan<D>,
    args: &GeodesicArgs,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
) -> Result<Exit, CliError> {
    let output = args.run.output.as_path();
    // Fail before the computation if the folder cannot be written to.
    ResultDir::create(output).map(drop)?;
    let (config, parts) = (plan.config, plan.parts);
    let params = &config.params;
    let grids = plan.placed.grid.hierarchy(first_nodes(params));
    let grid = plan.placed.grid;
    let (inputs, distances) = prepare(plan.placed, &plan.views, progress)?;
    let [first, last] = shapes(
        &inputs,
        distances,
        parts.as_ref(),
        plan.views,
        config.occluded,
        grid,
    )?;
    progress.stage("finding a first path");
    let begin = Instant::now();
    let mut watch = ProgressObserver::new(progress, interrupt, level_nodes(&grids));
    let result = geodesic_between(&first, &last, params, &mut watch)?;
    let history = watch.finish();
    let outcome = Outcome {
        inputs,
        config,
        labels: parts.map(|parts| parts.labels).unwrap_or_default(),
        result,
        history,
        start,
        solver_seconds: begin.elapsed().as_secs_f64(),
    };
    progress.stage("writing");
    interrupt.writing();
    let directory = ResultDir::create(output)?;
    let record = write::write_all(&directory, &outcome)?;
    let target = directory.commit()?;
    progress.finish();
    summary::print(&record, &target);
    Ok(if record.cancelled() {
        Exit::Interrupted
    } else {
        Exit::Success
    })
}

/// Nodes per side of the first level.
fn first_nodes(params: &GeodesicParams) -> usize {
    match params.form {
        Form::Lagrangian => params.coarsest_nodes,
        Form::LevelSets => params.flow_nodes,
    }
}

/// Both shapes with their components and visibility.
fn shapes<const D: usize>(
    inputs: &[Input<D>],
    distances: Vec<ScalarField<f64, D>>,
    parts: Option<&Components<D>>,
    views: [Option<VisibilityMask<D>>; 2],
    occluded: Option<Occluded>,
    grid: Grid<D>,
) -> Result<[Shape<D>; 2], CliError> {
    let hidden = |which| occluded == Some(which) || occluded == Some(Occluded::Both);
    let hidden = [hidden(Occluded::Start), hidden(Occluded::End)];
    let mut found = Vec::new();
    for (number, ((input, distance), view)) in inputs.iter().zip(distances).zip(views).enumerate() {
        let mut components = vec![distance];
        if let Some(parts) = parts {
            components.extend(parts.distances(number, input, grid)?);
        }
        let known = match view {
            Some(view) => {
                let view = view_of(&view, input, grid)?;
                components[0] = view.distance;
                Known::Within(view.weight)
            }
            None if hidden[number] => Known::Inside,
            None => Known::Everywhere,
        };
        found.push(Shape::of_components(components)?.with_known(known));
    }
    found
        .try_into()
        .map_err(|found: Vec<_>| CliError::TooFewInputs {
            command: "geodesic",
            needed: 2,
            found: found.len(),
        })
}
