//! `shapespace average --joint`: grey images in, their edges, found and averaged at the same time,
//! out.

mod draw;
mod plan;
mod record;
mod write;

use std::time::Instant;

use fe_grid::ScalarField;
use shape_average::joint::{JointParams, JointResult, joint_average_from};

use super::checkpoint::{begin, compare_places};
use crate::average::AverageArgs;
use crate::error::{CliError, Exit};
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::watch::{Course, Interrupt, Watch, level_nodes};
use plan::{AnyPlan, JointPlan, PlacedImage, plan_joint};

/// Everything there is to tell about a joint average.
struct Outcome<const D: usize> {
    images: Vec<PlacedImage<D>>,
    /// Their values on the grid.
    nodal: Vec<ScalarField<f64, D>>,
    parameters: plan::Parameters,
    params: JointParams,
    result: JointResult<D>,
    course: Vec<Course>,
    start: Instant,
}

/// Runs `shapespace average --joint`.
///
/// # Errors
/// [`CliError`]; then nothing has been written.
pub(super) fn run_joint(args: &AverageArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    in_pool(args.common.threads, || {
        progress.stage(format!("reading {} images", args.inputs.len()));
        match plan_joint(args)? {
            AnyPlan::D2(plan) => run_plan(plan, args, &progress, interrupt, start),
            AnyPlan::D3(plan) => run_plan(plan, args, &progress, interrupt, start),
        }
    })
}

fn run_plan<const D: usize>(
    plan: JointPlan<D>,
    args: &AverageArgs,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
) -> Result<Exit, CliError> {
    let output = args.common.output.as_path();
    // A folder that cannot be written to is better known before the computation than after it.
    ResultDir::create(output).map(drop)?;
    let JointPlan {
        images,
        nodal,
        parameters,
        params,
        fingerprint,
    } = plan;
    let grids = nodal[0]
        .grid()
        .hierarchy(params.segmentation.coarsest_nodes);
    compare_places(
        args.start.as_ref(),
        images.iter().map(|i| i.frame),
        progress,
    );
    let watch = Watch::new(progress, interrupt, level_nodes(&grids));
    let leads = vec![true; nodal.len()];
    let (mut keeper, known) = begin(args, fingerprint, grids, leads, watch)?;
    let result = joint_average_from(&nodal, &known, &params, &mut keeper)?;
    let (course, checkpoints) = keeper.finish();
    let outcome = Outcome {
        images,
        nodal,
        parameters,
        params,
        result,
        course,
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
    record.print(&target);
    Ok(if record.cancelled() {
        Exit::Interrupted
    } else {
        Exit::Success
    })
}
