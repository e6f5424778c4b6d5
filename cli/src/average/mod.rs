//! `shapespace average`: masks in, their elastic average out.
//!
//! `args` are the options, `plan` reads and checks, `memory` sees to it that there is room, `checkpoint` has what a run goes on
//! from, `record` and `write` make the result directory, `draw` its picture, `summary` the closing
//! words. `sweep` averages with many weights, `views` has what was seen of the masks, `joint` images
//! instead of masks.

mod args;
mod checkpoint;
mod draw;
mod joint;
mod memory;
mod plan;
mod record;
mod summary;
mod sweep;
mod views;
mod write;

use std::time::Instant;

use shape_average::{AverageResult, MemoryEstimate, average_from};

use crate::error::{CliError, Exit};
use crate::input::Image;
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::shapes::{Input, prepare};
use crate::watch::{Course, Interrupt, Watch, level_nodes};
use checkpoint::{begin, compare_places, fingerprint};
use draw::{Draw, Pictures};
use memory::provide;

pub use args::{AverageArgs, Boundary, Mean, Solver};
pub use plan::{AnyPlan, AveragePlan, Parameters, plan_average, plan_images};
pub(crate) use sweep::weights as weights_between;
pub(crate) use write::write_inputs;

/// Everything there is to tell about an average.
struct Outcome<const D: usize> {
    inputs: Vec<Input<D>>,
    parameters: Parameters,
    result: AverageResult<D>,
    course: Vec<Course>,
    memory: MemoryEstimate,
    start: Instant,
}

/// Runs `shapespace average`.
///
/// # Errors
/// [`CliError`]; then nothing has been written.
pub fn run_average(args: &AverageArgs) -> Result<Exit, CliError> {
    if args.joint {
        return joint::run_joint(args);
    }
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    in_pool(args.common.threads, || {
        progress.stage(format!("reading {} masks", args.inputs.len()));
        match plan_average(args)? {
            AnyPlan::D2(plan) => run_plan(plan, args, &progress, interrupt, start, None),
            AnyPlan::D3(plan) => run_plan(plan, args, &progress, interrupt, start, None),
        }
    })
}

/// Averages images that have not been read from files; they are written to the folder `inputs`
/// of the results.
pub(crate) fn run_drawn(images: Vec<Image<2>>, args: &AverageArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    in_pool(args.common.threads, || {
        let drawn = images.clone();
        let plan = plan_images(images, args)?;
        run_plan(plan, args, &progress, interrupt, start, Some(drawn))
    })
}

fn run_plan<const D: usize>(
    plan: AveragePlan<D>,
    args: &AverageArgs,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
    drawn: Option<Vec<Image<D>>>,
) -> Result<Exit, CliError>
where
    Pictures: Draw<D>,
{
    if let Some(side) = args.sweep {
        return sweep::run_sweep(plan, args, side as usize, progress, interrupt, start);
    }
    let output = args.common.output.as_path();
    // A folder that cannot be written to is better known before the computation than after it.
    ResultDir::create(output).map(drop)?;
    let (grid, parameters) = (plan.placed.grid, plan.parameters);
    let mut params = parameters.average_params();
    let n = plan.placed.images.len();
    let memory = provide(&mut params, n, !plan.views.is_empty(), grid, args, progress)?;
    let grids = grid.hierarchy(params.coarsest_nodes);
    let watch = Watch::new(progress, interrupt, level_nodes(&grids));
    let leads = parameters.weights.iter().map(|w| *w > 0.0).collect();
    let fingerprint = fingerprint(&parameters, &plan.placed.images, &plan.views);
    let (mut keeper, known) = begin(args, fingerprint, grids, leads, watch)?;
    let (mut inputs, mut distances) = prepare(plan.placed, &plan.views, progress)?;
    compare_places(
        args.start.as_ref(),
        inputs.iter().map(|i| i.frame),
        progress,
    );
    let seen = views::apply(&plan.views, &mut inputs, &mut distances, grid)?;
    let result = average_from(&distances, &seen, &known, &params, &mut keeper)?;
    let (course, checkpoints) = keeper.finish();
    drop(known);
    drop((distances, seen));
    let outcome = Outcome {
        inputs,
        parameters,
        result,
        course,
        memory,
        start,
    };
    progress.stage("writing");
    interrupt.writing();
    let directory = ResultDir::create(output)?;
    if let Some(drawn) = drawn {
        write::write_inputs(&directory, &drawn)?;
    }
    let record = write::write_all(&directory, &outcome)?;
    let target = directory.commit()?;
    if let Some(checkpoints) = checkpoints {
        checkpoints.remove()?;
    }
    progress.finish();
    summary::print(&record, &target);
    Ok(if record.cancelled() {
        Exit::Interrupted
    } else {
        Exit::Success
    })
}
