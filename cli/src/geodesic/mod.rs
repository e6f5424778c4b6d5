//! `shapespace geodesic`: two masks in, the shortest path between their shapes out.
//!
//! `plan` reads and checks, `path` holds the boundaries and densities along the result, `record`
//! and `write` make the result directory, `draw` its pictures, `summary` the closing words.

mod args;
pub(crate) mod draw;
pub(crate) mod path;
mod plan;
mod record;
mod summary;
pub(crate) mod write;

use std::time::Instant;

use ::geodesic::{Geodesic, Known, Shape, geodesic_between};
use fe_grid::{Grid, ScalarField};

use crate::error::{CliError, Exit};
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::shapes::{Components, Input, SeenMask, prepare, view_of};
use crate::watch::{Course, Interrupt, Watch, level_nodes};
use draw::{Draw, Pictures};

pub use args::{Form, GeodesicArgs, Occluded, PathArgs};
pub use plan::{AnyPlan, GeodesicPlan, Parameters, plan_geodesic};

/// Everything there is to tell about a geodesic.
struct Outcome<const D: usize> {
    /// Start and end.
    inputs: Vec<Input<D>>,
    parameters: Parameters,
    result: Geodesic<D>,
    course: Vec<Course>,
    start: Instant,
    /// Of the time, the minimisation.
    solver_seconds: f64,
}

/// Runs `shapespace geodesic`.
///
/// # Errors
/// [`CliError`]; then nothing has been written.
pub fn run_geodesic(args: &GeodesicArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    in_pool(args.common.threads, || {
        progress.stage("reading 2 masks");
        match plan_geodesic(args)? {
            AnyPlan::D2(plan) => run_plan(plan, args, &progress, interrupt, start),
            AnyPlan::D3(plan) => run_plan(plan, args, &progress, interrupt, start),
        }
    })
}

fn run_plan<const D: usize>(
    plan: GeodesicPlan<D>,
    args: &GeodesicArgs,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
) -> Result<Exit, CliError>
where
    Pictures: Draw<D>,
{
    let output = args.common.output.as_path();
    // A folder that cannot be written to is better known before the computation than after it.
    ResultDir::create(output).map(drop)?;
    let parameters = plan.parameters;
    let params = parameters.geodesic_params();
    let grids = plan.placed.grid.hierarchy(parameters.first_nodes());
    let grid = plan.placed.grid;
    let (inputs, distances) = prepare(plan.placed, &plan.views, progress)?;
    let [first, last] = shapes(
        &inputs,
        distances,
        plan.parts.as_ref(),
        plan.views,
        &parameters,
        grid,
    )?;
    progress.stage("finding a first path");
    let begin = Instant::now();
    let mut watch = Watch::new(progress, interrupt, level_nodes(&grids));
    let result = geodesic_between(&first, &last, &params, &mut watch)?;
    let course = watch.finish();
    let outcome = Outcome {
        inputs,
        parameters,
        result,
        course,
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

/// Both shapes with their components, and with what is known of them.
fn shapes<const D: usize>(
    inputs: &[Input<D>],
    distances: Vec<ScalarField<f64, D>>,
    parts: Option<&Components<D>>,
    views: [Option<SeenMask<D>>; 2],
    parameters: &Parameters,
    grid: Grid<D>,
) -> Result<[Shape<D>; 2], CliError> {
    let hidden = |occluded| match parameters.occluded {
        Some(found) => found == occluded || found == Occluded::Both,
        None => false,
    };
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
