//! `shapespace average`: computes the elastic average of masks.
//!
//! `args` are the options, `plan` reads and validates the inputs, `memory` estimates and limits the
//! memory, `checkpoint` provides initial deformations, `record` and `write` write the result
//! directory, `draw` its picture, `summary` the summary. `sweep` averages with many weights,
//! `views` reads visibility masks, `joint` averages grey images.

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

use shape_average::{AverageParams, AverageResult, MemoryEstimate, average_from};

use crate::error::{CliError, Exit};
use crate::input::Image;
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::shapes::{Input, prepare};
use crate::watch::{HistoryPoint, Interrupt, ProgressObserver, level_nodes};
use checkpoint::{begin, compare_places, fingerprint};
use memory::provide;
use plan::plan_images;

pub use args::{AverageArgs, AverageConfig, AverageRun};
pub use plan::{AnyPlan, AveragePlan, plan_average};
pub(crate) use sweep::weights as weights_between;
pub(crate) use write::write_inputs;

/// The result of a computation.
struct Outcome<const D: usize> {
    inputs: Vec<Input<D>>,
    config: AverageConfig,
    result: AverageResult<D>,
    history: Vec<HistoryPoint>,
    memory: MemoryEstimate,
    start: Instant,
}

/// Runs `shapespace average`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_average(args: &AverageArgs) -> Result<Exit, CliError> {
    args.config.run(|config| run(config, &args.run))
}

fn run(config: AverageConfig, run: &AverageRun) -> Result<Exit, CliError> {
    if config.joint {
        return joint::run_joint(config, run);
    }
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    in_pool(run.common.threads, || {
        progress.stage(format!("reading {} masks", config.inputs.len()));
        match plan_average(config, &run.common.output)? {
            AnyPlan::D2(plan) => run_plan(plan, run, &progress, interrupt, start, None),
            AnyPlan::D3(plan) => run_plan(plan, run, &progress, interrupt, start, None),
        }
    })
}

/// Averages images that are not read from files; they are written to the folder `inputs` of the
/// results.
pub(crate) fn run_drawn(
    images: Vec<Image<2>>,
    config: AverageConfig,
    run: &AverageRun,
) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    in_pool(run.common.threads, || {
        let drawn = images.clone();
        let inputs = images.iter().map(|image| image.path.clone()).collect();
        let plan = plan_images(images, Vec::new(), AverageConfig { inputs, ..config })?;
        run_plan(plan, run, &progress, interrupt, start, Some(drawn))
    })
}

fn run_plan<const D: usize>(
    plan: AveragePlan<D>,
    run: &AverageRun,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
    drawn: Option<Vec<Image<D>>>,
) -> Result<Exit, CliError> {
    if let Some(side) = plan.config.sweep {
        return sweep::run_sweep(plan, run, side, progress, interrupt, start);
    }
    let output = run.common.output.as_path();
    // Fail before the computation if the folder cannot be written to.
    ResultDir::create(output).map(drop)?;
    let (grid, config) = (plan.placed.grid, plan.config);
    let weights = config.weights()?;
    let leads = weights.iter().map(|w| *w > 0.0).collect();
    let mut params = AverageParams {
        weights: Some(weights),
        ..config.params.clone()
    };
    let n = plan.placed.images.len();
    let memory = provide(&mut params, n, !plan.views.is_empty(), grid, run, progress)?;
    let grids = grid.hierarchy(params.coarsest_nodes);
    let watch = ProgressObserver::new(progress, interrupt, level_nodes(&grids));
    let fingerprint = fingerprint(&config, &plan.placed.images, &plan.views);
    let start_of = config.start.as_deref();
    let (mut checkpointer, known) = begin(start_of, run, fingerprint, grids, leads, watch)?;
    let (mut inputs, mut distances) = prepare(plan.placed, &plan.views, progress)?;
    compare_places(start_of, inputs.iter().map(|i| i.frame), progress);
    let seen = views::apply(&plan.views, &mut inputs, &mut distances, grid)?;
    let result = average_from(&distances, &seen, &known, &params, &mut checkpointer)?;
    let (history, checkpoints) = checkpointer.finish();
    drop(known);
    drop((distances, seen));
    let outcome = Outcome {
        inputs,
        config,
        result,
        history,
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
