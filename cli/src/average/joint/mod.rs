//! `shapespace average --joint`: segments and averages grey images simultaneously.

mod draw;
mod plan;
mod record;
mod write;

use std::time::Instant;

use fe_grid::ScalarField;
use shape_average::joint::{JointParams, JointResult, joint_average_from};

use super::checkpoint::{begin, compare_places};
use crate::error::{CliError, Exit};
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::watch::{HistoryPoint, Interrupt, ProgressObserver, level_nodes};
use plan::{AnyPlan, JointPlan, PlacedImage, plan_joint};

use super::args::{AverageConfig, AverageRun, not_joint};

/// The result of a computation.
struct Outcome<const D: usize> {
    images: Vec<PlacedImage<D>>,
    /// Their values on the grid.
    nodal: Vec<ScalarField<f64, D>>,
    config: AverageConfig,
    params: JointParams,
    result: JointResult<D>,
    history: Vec<HistoryPoint>,
    start: Instant,
}

/// Runs `shapespace average --joint`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub(super) fn run_joint(config: AverageConfig, run: &AverageRun) -> Result<Exit, CliError> {
    if run.memory.is_some() {
        return Err(not_joint("--memory"));
    }
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    in_pool(run.common.threads, || {
        progress.stage(format!("reading {} images", config.inputs.len()));
        match plan_joint(config, &run.common.output)? {
            AnyPlan::D2(plan) => run_plan(plan, run, &progress, interrupt, start),
            AnyPlan::D3(plan) => run_plan(plan, run, &progress, interrupt, start),
        }
    })
}

fn run_plan<const D: usize>(
    plan: JointPlan<D>,
    run: &AverageRun,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
) -> Result<Exit, CliError> {
    let output = run.common.output.as_path();
    // Fail before the computation if the folder cannot be written to.
    ResultDir::create(output).map(drop)?;
    let JointPlan {
        images,
        nodal,
        config,
        params,
        fingerprint,
    } = plan;
    let grids = nodal[0]
        .grid()
        .hierarchy(params.segmentation.coarsest_nodes);
    let start_of = config.start.as_deref();
    compare_places(start_of, images.iter().map(|i| i.frame), progress);
    let watch = ProgressObserver::new(progress, interrupt, level_nodes(&grids));
    let leads = vec![true; nodal.len()];
    let (mut checkpointer, known) = begin(start_of, run, fingerprint, grids, leads, watch)?;
    let result = joint_average_from(&nodal, &known, &params, &mut checkpointer)?;
    let (history, checkpoints) = checkpointer.finish();
    let outcome = Outcome {
        images,
        nodal,
        config,
        params,
        result,
        history,
        start,
    };
    progress.stage("writing");
    interrupt.writing();
    let directory = ResultDir::create(output)?;
    let record = write::write_all(&directory, &outcome)?;
    let target = directory.commit()?;
    if let Some(checkpoints) = checkpoints {
        checkpoints.remove()?;
    }
    progress.finish();
    record::print(&record, &target);
    Ok(if record.cancelled() {
        Exit::Interrupted
    } else {
        Exit::Success
    })
}
