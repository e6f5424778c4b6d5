//! `shapespace average`: masks in, their elastic average out.
//!
//! `plan` reads and checks, `shapes` turns masks into boundaries and signed distances, `place`
//! aligns them, `memory` sees to it that there is room, `watch` shows progress and hears Ctrl-C, `record` and `write` make the result
//! directory, `draw` its picture, `label` the names in it, `summary` the closing words.

mod draw;
mod label;
mod memory;
mod place;
mod plan;
mod record;
mod shapes;
mod summary;
mod watch;
mod write;

use std::path::PathBuf;
use std::time::Instant;

use fe_grid::Grid;
use shape_average::{AverageResult, MemoryEstimate, average};

use crate::args::AverageArgs;
use crate::error::{CliError, Exit};
use crate::input::Image;
use crate::output::ResultDir;
use crate::progress::Progress;
use draw::{Draw, Pictures};
use memory::provide;
use shapes::{Input, prepare};
use watch::{Course, Interrupt, Watch};

pub(crate) use memory::{bytes, format_bytes};
pub use plan::{AnyPlan, AveragePlan, Parameters, plan_average, plan_images};

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
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    in_pool(args.threads, || {
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
    in_pool(args.threads, || {
        let drawn = images.clone();
        let plan = plan_images(images, args)?;
        run_plan(plan, args, &progress, interrupt, start, Some(drawn))
    })
}

/// Runs work on a number of threads, or on all cores.
fn in_pool<T: Send>(
    threads: Option<u32>,
    work: impl FnOnce() -> Result<T, CliError> + Send,
) -> Result<T, CliError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0) as usize)
        .build()
        .map_err(|error| CliError::Computation {
            message: format!("the threads cannot be started: {error}"),
            remedy: "ask for fewer with --threads".into(),
        })?
        .install(work)
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
    let output = args.output.as_path();
    // A folder that cannot be written to is better known before the computation than after it.
    ResultDir::create(output).map(drop)?;
    let (grid, parameters) = (plan.grid, plan.parameters.clone());
    let mut params = parameters.average_params();
    let n = plan.images.len();
    let memory = provide(&mut params, n, grid, args, progress)?;
    let (inputs, distances) = prepare(plan, progress)?;
    let mut watch = Watch::new(
        progress,
        interrupt,
        level_nodes(grid, params.coarsest_nodes),
    );
    let result = average(&distances, &params, &mut watch)?;
    let course = watch.finish();
    drop(distances);
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
    progress.finish();
    summary::print(&record, &target);
    Ok(if record.cancelled() {
        Exit::Interrupted
    } else {
        Exit::Success
    })
}

/// Nodes a side of every level, coarsest first.
fn level_nodes<const D: usize>(grid: Grid<D>, coarsest: usize) -> Vec<usize> {
    let hierarchy = grid.hierarchy(coarsest);
    hierarchy.iter().map(|g| g.nodes_per_axis()[0]).collect()
}

/// Names of the files that belong to one shape, `kind_000.npy` and so on.
fn numbered(kind: &str, index: usize) -> PathBuf {
    PathBuf::from(format!("{kind}_{index:03}.npy"))
}
