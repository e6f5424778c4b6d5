//! `shapespace geodesic`: two masks in, the shortest path between their shapes out.
//!
//! `plan` reads and checks, `path` holds the boundaries and densities along the result, `record`
//! and `write` make the result directory, `draw` its pictures, `summary` the closing words.

mod args;
mod draw;
mod path;
mod plan;
mod record;
mod summary;
mod write;

use std::time::Instant;

use ::geodesic::{Geodesic, geodesic};

use crate::error::{CliError, Exit};
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::shapes::{Input, prepare};
use crate::watch::{Course, Interrupt, Watch, level_nodes};
use draw::{Draw, Pictures};

pub use args::{Form, GeodesicArgs, PathArgs};
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
    let (inputs, distances) = prepare(plan.placed, progress)?;
    let [first, last] = distances.as_slice() else {
        return Err(CliError::TooFewInputs {
            command: "geodesic",
            needed: 2,
            found: distances.len(),
        });
    };
    progress.stage("finding a first path");
    let begin = Instant::now();
    let mut watch = Watch::new(progress, interrupt, level_nodes(&grids));
    let result = geodesic(first, last, &params, &mut watch)?;
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
