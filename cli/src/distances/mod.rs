//! `shapespace distances`: computes the distances between all pairs of masks, or from new to stored ones.
//!
//! `plan` reads and validates the inputs, `scope` says which pairs are asked for, `store` stores finished
//! pairs for the next run, `compute` processes several pairs at a time, `helpers` those of other
//! processes, `pair` is one of them; `shard`
//! divides them among machines. `detours` shortens paths that violate the triangle inequality. `skip` finds out which pairs may be near, by the numbers of `surrogate`.
//! `study` computes matrices and clusters, `map` an embedding, `neighbours` the
//! nearest neighbours, `record` and `write` write the result directory, `draw` its pictures, `summary`
//! summarises it; `classes` determines the classes of the inputs.
//!
//! The distance of two shapes is the mean of the lengths in both directions. A path that folds or
//! does not reach its end is not used: the other direction counts alone, and if neither can be used
//! the distance is the shortest way through other shapes, and marked.

mod args;
mod classes;
mod compute;
mod detours;
mod draw;
mod helpers;
mod map;
mod neighbours;
mod pair;
mod plan;
mod record;
mod scope;
mod shard;
mod skip;
mod store;
mod study;
mod summary;
mod surrogate;
mod write;

use std::path::PathBuf;

use ::geodesic::memory_estimate;
use fe_grid::{Grid, ScalarField};

use crate::error::{CliError, Exit};
use crate::memory::announce;
use crate::options::{Align, CheckpointOption, RunOptions};
use crate::output::{ResultDir, WorkDir};
use crate::session::{self, Command, PlanOf, Session};
use crate::shapes::{Domain, Input, Pairs, Placed, refined, settle};
use crate::summary::Summary;
use classes::Labels;
pub(crate) use classes::{Classes, NAMED, class_column, is_hint, table_reader};
use compute::Task;
use detours::{Detours, shorten};
use helpers::{dismiss, help};
use pair::PairRecord;
use plan::{DistancesPlan, plan_distances};
use scope::{Scope, paths};
use shard::Shard;
use skip::{Skipped, near_pairs};
use store::{Store, fingerprint};
use study::Study;

pub use args::{DistancesArgs, DistancesConfig};

/// The distances between all pairs of masks.
pub(crate) struct DistanceStudy {
    pub config: DistancesConfig,
    /// Paths computed at the same time.
    pub at_once: Option<u32>,
    /// The part of the pairs to be computed; all by default.
    pub shard: Option<Shard>,
    /// Result directories whose paths are used.
    pub merge: Vec<PathBuf>,
}

/// The result of a computation.
pub(crate) struct Outcome<const D: usize> {
    inputs: Vec<Input<D>>,
    scope: Scope,
    labels: Option<Labels>,
    config: DistancesConfig,
    /// The part of the pairs that was computed; all by default.
    shard: Option<Shard>,
    /// The grid of all pairs.
    grid: Grid<D>,
    /// The placement of the pairs.
    align: &'static str,
    records: Vec<PairRecord>,
    /// What was skipped, if far pairs are.
    skipped: Option<Skipped>,
    /// The paths that were minimised from ways through third shapes.
    detours: Detours,
    study: Study,
    work: Option<WorkDir>,
}

/// Runs `shapespace distances`.
///
/// # Errors
/// [`CliError`]; then there is no result directory, but finished pairs are stored.
pub fn run_distances(args: &DistancesArgs) -> Result<Exit, CliError> {
    let run: &RunOptions = &args.run;
    let with = |config| {
        let study = DistanceStudy {
            config,
            at_once: args.at_once,
            shard: args.shard,
            merge: args.merge.clone(),
        };
        session::run(&study, run, CheckpointOption::NONE)
    };
    session::logged(run, || args.config.run(with))
}

impl DistanceStudy {
    /// Announces the memory of the shapes and of the paths that are computed at the same time.
    fn announce_memory<const D: usize>(
        &self,
        n_shapes: usize,
        grid: &Grid<D>,
        config: &DistancesConfig,
        session: &Session<'_>,
    ) -> Result<(), CliError> {
        let threads = rayon::current_num_threads();
        let at_once = self.at_once.map_or(threads, |n| threads.min(n as usize));
        let fields = |n: usize, grid: &Grid<D>| (size_of::<f64>() * grid.n_nodes() * n) as u64;
        // Of the first direction of a pair the steps, both kinds of deformations and the shapes are kept.
        let kept = (config.directions() - 1) * config.params.steps * (2 * D + 1);
        // Of a way through a third shape its deformations are.
        let through = match config.detours() {
            0 => 0,
            _ => 2 * config.params.steps * D,
        };
        let kept = kept.max(through);
        let finest = refined(grid, config.refinements(grid));
        let path = memory_estimate(&config.params, 1, &finest) + fields(kept, &finest);
        let needed = fields(n_shapes, grid) + at_once as u64 * path;
        announce(needed, grid, &session.progress)
    }
}

impl Command for DistanceStudy {
    const DISTRIBUTED: bool = true;

    type Plan<const D: usize> = DistancesPlan<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        if let (Some(shard), Some(_)) = (self.shard, self.config.skip_far) {
            return Err(CliError::Option {
                option: "--shard",
                value: format!("{shard} with --skip-far"),
                remedy: "which pairs are far is found out on the way: leave out one of both".into(),
            });
        }
        let n = self.config.shapes().len();
        session.progress.stage(format!("reading {n} masks"));
        plan_distances(self.config.clone(), &session.sources)
    }

    fn compute<const D: usize>(
        &self,
        plan: DistancesPlan<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let (domain, config) = (plan.placed.domain, plan.config);
        let scope = Scope::new(&config);
        let fingerprint = fingerprint(&config, &scope, &plan.placed.images);
        let (own, inputs, distances) = measured(plan.placed, session)?;
        let mut wanted = paths(&scope.asked_for(), config.one_way);
        if let Some(shard) = self.shard {
            wanted = shard.part(&wanted, config.directions());
        }
        // Before anything is written.
        self.announce_memory(inputs.len(), &own, &config, session)?;
        for directory in &self.merge {
            fingerprint.check(directory)?;
        }
        let store = Store::open(session.output, &fingerprint)?;
        // Where far pairs are skipped, nobody knows yet how many of these there will be.
        let most = match config.skip_far {
            Some(_) => paths(&scope.possible(), config.one_way),
            None => wanted.clone(),
        };
        let interrupted = || store.interrupted(&most);
        let pairs = Pairs::placed(inputs, distances, own);
        let pairs = in_position(pairs, &domain, &config, &scope, session)?;
        let pairs = pairs.ok_or_else(interrupted)?;
        let task = Task {
            pairs: &pairs,
            config: &config,
            store: &store,
            merge: &self.merge,
            at_once: self.at_once,
            session,
        };
        let mut records = task.run(&wanted)?.ok_or_else(interrupted)?;
        let mut skipped = None;
        if let Some(share) = config.skip_far {
            let found = near_pairs(&task, &scope, share, records)?.ok_or_else(interrupted)?;
            (records, skipped) = (found.0, Some(found.1));
        }
        let mut detours = Detours::default();
        // A part of the pairs has no third shapes.
        let whole = self.shard.is_none();
        if whole {
            let found = shorten(&task, scope.n_shapes(), records)?.ok_or_else(interrupted)?;
            (records, detours) = found;
        }
        dismiss(&*session.processes);
        let labels = plan.labels;
        Ok(Outcome {
            study: Study::new(&scope, &records, &config, labels.as_ref(), whole)?,
            shard: self.shard,
            scope,
            labels,
            grid: pairs.grid,
            inputs: pairs.inputs,
            align: if is_aligned(&config) { "pairs" } else { "none" },
            config,
            records,
            skipped,
            detours,
            work: Some(store.into_directory()),
        })
    }

    fn assist<const D: usize>(
        &self,
        plan: DistancesPlan<D>,
        session: &Session<'_>,
    ) -> Result<(), CliError> {
        let (domain, config) = (plan.placed.domain, plan.config);
        let scope = Scope::new(&config);
        let (own, inputs, distances) = measured(plan.placed, session)?;
        self.announce_memory(inputs.len(), &own, &config, session)?;
        let pairs = Pairs::placed(inputs, distances, own);
        let pairs = in_position(pairs, &domain, &config, &scope, session)?;
        // Only the first process is interrupted, and ends all.
        let pairs = pairs.ok_or(CliError::Stopped)?;
        help(&pairs, &config, self.at_once, session)
    }

    fn work<const D: usize>(outcome: &mut Outcome<D>) -> Option<WorkDir> {
        outcome.work.take()
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        write::write_all(directory, outcome, session)
    }
}

/// The grid of shapes that are not aligned, and their signed distances on it.
fn measured<const D: usize>(
    placed: Placed<D>,
    session: &Session<'_>,
) -> Result<(Grid<D>, Vec<Input<D>>, Vec<ScalarField<f64, D>>), CliError> {
    let (progress, processes) = (&session.progress, &session.processes);
    let settled = settle(placed, &[], None, progress, processes)?;
    let grid = settled.grid;
    let (inputs, distances) = settled.measure(progress, processes)?;
    Ok((grid, inputs, distances))
}

/// Whether every pair has a position of its own.
fn is_aligned(config: &DistancesConfig) -> bool {
    config.masks.align == Some(Align::Rigid)
}

/// Aligns the pairs, if they are to be aligned; `None` if interrupted.
fn in_position<const D: usize>(
    placed: Pairs<D>,
    domain: &Domain<D>,
    config: &DistancesConfig,
    scope: &Scope,
    session: &Session<'_>,
) -> Result<Option<Pairs<D>>, CliError> {
    if !is_aligned(config) {
        return Ok(Some(placed));
    }
    let possible = scope.possible();
    let count = possible.len();
    session.progress.stage(format!("aligning {count} pairs"));
    let asked = || session.interrupt.asked();
    let (inputs, distances, own) = (placed.inputs, placed.distances, placed.grid);
    let shared = session.distribution(inputs.len());
    Pairs::aligned(inputs, distances, possible, &own, domain, &shared, asked)
}
