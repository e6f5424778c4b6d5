//! `shapespace segment`: computes edges and objects of grey images.
//!
//! `args` are the options, `plan` reads and validates the images, `compute` finds edges and
//! objects, `record` and `write` write the result directory, `draw` its picture.

mod args;
mod compute;
mod draw;
mod plan;
mod record;
mod write;

use std::time::Instant;

pub use args::{Object, SegmentArgs, SegmentConfig};

use crate::error::{CliError, Exit};
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::watch::Interrupt;
use plan::{AnyPlan, SegmentPlan, plan_segment};

/// Runs `shapespace segment`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_segment(args: &SegmentArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    let compute = |config: SegmentConfig| {
        progress.stage(format!("reading {} images", config.inputs.len()));
        match plan_segment(config, &args.run.output)? {
            AnyPlan::D2(plan) => run_plan(plan, args, &progress, interrupt, start),
            AnyPlan::D3(plan) => run_plan(plan, args, &progress, interrupt, start),
        }
    };
    args.config
        .run(|config| in_pool(args.run.threads, || compute(config)))
}

fn run_plan<const D: usize>(
    plan: SegmentPlan<D>,
    args: &SegmentArgs,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
) -> Result<Exit, CliError> {
    // Fail before the computation if the folder cannot be written to.
    ResultDir::create(&args.run.output).map(drop)?;
    let found = compute::compute(plan.images, &plan.config, progress, interrupt)?;
    progress.stage("writing");
    interrupt.writing();
    let directory = ResultDir::create(&args.run.output)?;
    let record = write::write_all(&directory, &plan.config, &found, start)?;
    let target = directory.commit()?;
    progress.finish();
    record::print(&record, &target);
    Ok(if record.cancelled() {
        Exit::Interrupted
    } else {
        Exit::Success
    })
}
