//! `shapespace distances`: computes the distances between all pairs of masks.
//!
//! `plan` reads and validates the inputs, `store` stores finished pairs for the next run, `compute`
//! processes several pairs at a time, `pair` is one of them. `study` computes matrices, clusters
//! and an embedding, `record` and `write` write the result directory, `draw` its pictures,
//! `summary` the summary; `classes` determines the classes of the inputs.
//!
//! The distance of two shapes is the mean of the lengths in both directions. A path that folds or
//! does not reach its end is not used: the other direction counts alone, and if neither can be used
//! the distance is the shortest way through other shapes, and marked.

mod args;
mod classes;
mod compute;
mod draw;
mod pair;
mod plan;
mod record;
mod store;
mod study;
mod summary;
mod write;

use std::time::Instant;

use crate::error::{CliError, Exit};
use crate::options::Align;
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::shapes::{Input, Pairs, prepare};
use crate::watch::Interrupt;
use classes::Classes;
use compute::Task;
use pair::PairRecord;
use plan::{AnyPlan, DistancesPlan, plan_distances};
use store::{Store, fingerprint};
use study::Study;

pub use args::{DistancesArgs, DistancesConfig};

/// The result of a computation.
struct Outcome<const D: usize> {
    inputs: Vec<Input<D>>,
    classes: Option<Classes>,
    config: DistancesConfig,
    /// Nodes along each axis.
    nodes: [usize; D],
    /// The placement of the pairs.
    align: &'static str,
    records: Vec<PairRecord>,
    study: Study,
    start: Instant,
}

/// Runs `shapespace distances`.
///
/// # Errors
/// [`CliError`]; then there is no result directory, but finished pairs are stored.
pub fn run_distances(args: &DistancesArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    let compute = |config: DistancesConfig| {
        progress.stage(format!("reading {} masks", config.inputs.len()));
        match plan_distances(config, &args.run.output)? {
            AnyPlan::D2(plan) => run_plan(plan, args, &progress, interrupt, start),
            AnyPlan::D3(plan) => run_plan(plan, args, &progress, interrupt, start),
        }
    };
    args.config
        .run(|config| in_pool(args.run.threads, || compute(config)))
}

fn run_plan<const D: usize>(
    plan: DistancesPlan<D>,
    args: &DistancesArgs,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
) -> Result<Exit, CliError> {
    let (grid, config) = (plan.placed.grid, plan.config);
    let aligned = config.masks.align == Align::Rigid;
    let fingerprint = fingerprint(&config, &plan.placed.images);
    let (inputs, distances) = prepare(plan.placed, &[], progress)?;
    let wanted = wanted(inputs.len(), config.one_way);
    let store = Store::open(&args.run.output, &fingerprint)?;
    let interrupted = || {
        let kept: Vec<_> = wanted.iter().map(|ids| store.pair(*ids)).collect();
        progress.finish();
        let done = summary::finished(&kept);
        summary::print_interrupted(done, wanted.len(), store.directory().path());
        Ok(Exit::Interrupted)
    };
    let pairs = if aligned {
        progress.stage(format!(
            "aligning {} pairs",
            inputs.len() * (inputs.len() - 1) / 2
        ));
        match Pairs::aligned(inputs, distances, || interrupt.asked())? {
            Some(pairs) => pairs,
            None => return interrupted(),
        }
    } else {
        Pairs::placed(inputs, distances)
    };
    let task = Task {
        pairs: &pairs,
        grid,
        config: &config,
        store: &store,
        at_once: args.at_once,
        progress,
        interrupt,
    };
    let Some(records) = task.run(&wanted)? else {
        return interrupted();
    };
    progress.stage("writing");
    interrupt.writing();
    let n = pairs.inputs.len();
    let classes = plan.classes;
    let study = Study::new(n, &records, &config, classes.as_ref())?;
    let outcome = Outcome {
        inputs: pairs.inputs,
        classes,
        config,
        nodes: grid.nodes_per_axis(),
        align: if aligned { "pairs" } else { "none" },
        records,
        study,
        start,
    };
    let directory = store.into_directory();
    let record = write::write_all(&directory, &outcome)?;
    let target = directory.commit()?;
    progress.finish();
    summary::print(&record, &target);
    Ok(Exit::Success)
}

/// The pairs to be computed, in both directions by default.
fn wanted(n: usize, one_way: bool) -> Vec<[usize; 2]> {
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| [i, j]));
    if one_way {
        pairs.collect()
    } else {
        pairs.flat_map(|[i, j]| [[i, j], [j, i]]).collect()
    }
}
