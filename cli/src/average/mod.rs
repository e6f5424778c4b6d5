//! `shapespace average`: computes the elastic average of masks.
//!
//! `args` are the options, `plan` reads and validates the inputs, `memory` estimates and limits the
//! memory, `checkpoint` provides initial deformations, `record` and `write` write the result
//! directory, `draw` its picture, `strain` the maps of its strains, `table` its table of inputs. `sweep` averages with many weights,
//! `views` reads visibility masks, `components` has shapes of several labels, `minima` minimises from several starts, `error_bars` repeats averages on coarser grids, `joint` averages
//! grey images.

mod args;
mod components;
mod draw;
mod error_bars;
mod joint;
mod memory;
mod minima;
mod plan;
mod record;
mod start;
mod strain;
mod sweep;
mod table;
mod views;
mod write;

use std::sync::Arc;

use shape_average::{AverageParams, AverageResult, MemoryEstimate, Shapes, average_distributed};

use crate::error::{CliError, Exit};
use crate::history::HistoryPoint;
use crate::output::ResultDir;
use crate::processes::need_one;
use crate::session::{self, Command, PlanOf, Session};
use crate::shapes::{Input, add_topologies, settle};
use crate::summary::Summary;
use components::Parts;
pub(crate) use components::boundaries;
use error_bars::{ErrorBars, error_bars};
pub(crate) use joint::JointAverage;
use memory::provide;
use minima::{FoundMinima, Starting, lowest_of};
use plan::{AveragePlan, fingerprint, plan_average, plan_images};
use shapespace_input::Image;
use shapespace_input::dimension::Dim;
use shapespace_input::memory::set_limit as memory_limit;
use start::{compare_places, initial};
pub(crate) use sweep::Sweep;

pub use args::{AverageArgs, AverageConfig, AverageRun};
pub(crate) use sweep::weights as weights_between;
pub(crate) use write::write_inputs;

/// Averages masks.
pub(crate) struct Average {
    pub config: AverageConfig,
    pub run: AverageRun,
    /// Images to average instead of files; they are written to the folder `inputs` of the results.
    pub images: Option<Vec<Image<2>>>,
}

/// The result of a computation.
pub(crate) struct Outcome<const D: usize> {
    inputs: Vec<Input<D>>,
    /// The components of the inputs, if there are several.
    parts: Option<Parts<D>>,
    config: AverageConfig,
    result: AverageResult<D>,
    history: Vec<HistoryPoint>,
    memory: MemoryEstimate,
    error_bars: Option<ErrorBars>,
    /// Whether the user stopped the averages on coarser grids.
    interrupted: bool,
    minima: Option<FoundMinima>,
}

/// Runs `shapespace average`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_average(args: &AverageArgs) -> Result<Exit, CliError> {
    let run = &args.run;
    let checkpoint = run.checkpoint;
    memory_limit(run.memory);
    let with = |config: AverageConfig| {
        if config.joint {
            let run = run.clone();
            session::run(&JointAverage { config, run }, &args.run.common, checkpoint)
        } else if let Some(side) = config.sweep {
            session::run(&Sweep { config, side }, &run.common, checkpoint)
        } else {
            run_on(None, config, run)
        }
    };
    session::logged(&run.common, || args.config.run(with))
}

/// Averages images that are not read from files.
pub(crate) fn run_drawn(
    images: Vec<Image<2>>,
    config: AverageConfig,
    run: &AverageRun,
) -> Result<Exit, CliError> {
    let inputs = images.iter().map(|image| image.path.clone()).collect();
    run_on(Some(images), AverageConfig { inputs, ..config }, run)
}

fn run_on(
    images: Option<Vec<Image<2>>>,
    config: AverageConfig,
    run: &AverageRun,
) -> Result<Exit, CliError> {
    let average = Average {
        config,
        run: run.clone(),
        images,
    };
    session::run(&average, &run.common, run.checkpoint)
}

impl Command for Average {
    const DISTRIBUTED: bool = true;

    type Plan<const D: usize> = AveragePlan<D>;
    type Outcome<const D: usize> = Outcome<D>;

    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError> {
        let config = self.config.clone();
        match &self.images {
            Some(images) => plan_images(images.clone(), Vec::new(), config).map(Dim::D2),
            None => plan_average(config, &session.sources, &session.progress),
        }
    }

    fn compute<const D: usize>(
        &self,
        plan: AveragePlan<D>,
        session: &Session<'_>,
    ) -> Result<Outcome<D>, CliError> {
        let outcome = self.take_part(plan, session)?;
        // The first process has a result.
        outcome.ok_or_else(|| shape_average::AverageError::NoShapes.into())
    }

    fn assist<const D: usize>(
        &self,
        plan: AveragePlan<D>,
        session: &Session<'_>,
    ) -> Result<(), CliError> {
        self.take_part(plan, session).map(drop)
    }

    fn write<const D: usize>(
        &self,
        outcome: &Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError> {
        if let Some(images) = &self.images {
            write_inputs(directory, images)?;
        }
        write::write_all(directory, outcome, session)
    }
}

impl Average {
    /// Computes the average on all processes; the first one has it.
    fn take_part<const D: usize>(
        &self,
        plan: AveragePlan<D>,
        session: &Session<'_>,
    ) -> Result<Option<Outcome<D>>, CliError> {
        let config = plan.config;
        if config.starts.is_some() {
            need_one("the search for several minima")?;
        }
        let weights = config.weights()?;
        let mut params = AverageParams {
            weights: Some(weights),
            ..config.params.clone()
        };
        let (n, partly) = (plan.placed.images.len(), !plan.views.is_empty());
        let (images, views) = (&plan.placed.images, &plan.views);
        let fingerprint = fingerprint(&config, images, plan.parts.as_ref(), views);
        let n_components = plan.parts.as_ref().map_or(1, |parts| parts.labels.len());
        let settled = settle(
            plan.placed,
            &plan.views,
            plan.parts.as_ref(),
            &session.progress,
            &session.processes,
        )?;
        let grid = settled.grid;
        let shared = session.distribution(n);
        let memory = provide(
            &mut params,
            &shared,
            n_components,
            partly,
            grid,
            &self.run,
            &session.progress,
        )?;
        let grids = grid.hierarchy(params.coarsest_nodes);
        let start = config.start.as_deref();
        let known = initial(start, n, &grids, session.trust)?;
        let mut checkpointer = session.checkpointer(fingerprint)?;
        let (mut inputs, mut distances) = settled.measure(&session.progress, &session.processes)?;
        compare_places(start, inputs.iter().map(|i| i.frame), &session.progress);
        let parts = plan.parts.as_ref();
        let parts = parts.map(|parts| Parts::new(parts, &mut inputs, &plan.views, grid));
        let parts = parts.transpose()?;
        let visibility = views::apply(&plan.views, &mut inputs, &mut distances, grid)?;
        let (result, history, minima) = if let Some(starts) = config.starts {
            let shapes = Starting {
                distances: &distances,
                visibility: &visibility,
                known,
            };
            let checks = &mut checkpointer;
            let (result, history, found) =
                lowest_of(starts, shapes, &params, &grids, checks, session)?;
            (Some(result), history, Some(found))
        } else {
            let mut watch = checkpointer.observe(session.observer(&grids));
            let shapes = match &parts {
                Some(parts) => Shapes::of_components(&distances, &parts.distances, n_components)?,
                None => Shapes::new(&distances),
            };
            let result = average_distributed(
                Arc::clone(&session.processes),
                shapes,
                &visibility,
                &known,
                &params,
                &mut watch,
            )?;
            (result, watch.finish(), None)
        };
        let Some(result) = result else {
            session.ended(checkpointer);
            return Ok(None);
        };
        if visibility.is_empty() {
            add_topologies(&mut inputs, &distances, &result.average_indicator);
        }
        let error_bars = if config.error_bars {
            let checks = &mut checkpointer;
            error_bars(&result, distances, visibility, &params, checks, session)?
        } else {
            None
        };
        // The average itself says whether it was.
        let interrupted = config.error_bars && session.interrupt.asked();
        session.ended(checkpointer);
        Ok(Some(Outcome {
            inputs,
            parts,
            config,
            result,
            history,
            memory,
            error_bars,
            interrupted,
            minima,
        }))
    }
}
