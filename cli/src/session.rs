//! The stages of every command that computes: plan, compute, write, summary.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use clap::Args;
use fe_grid::communicator::{Alone, Communicator};
use fe_grid::{Distribution, Grid};

use crate::checkpoint::{Checkpointer, Place};
use crate::config::{Config, Configured};
use crate::error::{CliError, Exit};
use crate::fingerprint::Fingerprint;
use crate::grid::longest;
use crate::integrity::seal;
use crate::interrupt::Interrupt;
use crate::log::{self, LogFormat};
use crate::options::{CheckpointOption, RunOptions};
use crate::output::{OutputError, ResultDir, WorkDir};
use crate::page::{command_line, write_page};
use crate::pool::in_pool;
use crate::processes::{need_one, processes};
use crate::progress::Progress;
use crate::summary::Summary;
use crate::watch::{GridSize, ProgressObserver};
use shapespace_input::Sources;
use shapespace_input::dimension::Dim;

/// The circumstances of a run.
pub(crate) struct Session<'a> {
    /// The result directory.
    pub output: &'a Path,
    pub progress: Progress,
    pub interrupt: Interrupt,
    /// Where inputs are looked up.
    pub sources: Sources,
    pub start: Instant,
    /// Whether result directories are used without verification.
    pub trust: bool,
    /// When checkpoints are stored.
    pub checkpoint: CheckpointOption,
    /// The processes that compute the result.
    pub processes: Arc<dyn Communicator>,
    /// The checkpoints of a computation that has ended.
    pub obsolete: Mutex<Option<WorkDir>>,
}

impl<'a> Session<'a> {
    /// A run of this process alone from now on, on files, which nobody listens to or stops.
    pub fn alone(output: &'a Path) -> Session<'a> {
        Session {
            output,
            progress: Progress::hidden(),
            interrupt: Interrupt::of_call(),
            sources: Sources::files(),
            start: Instant::now(),
            trust: false,
            checkpoint: CheckpointOption::NONE,
            processes: Arc::new(Alone),
            obsolete: Mutex::default(),
        }
    }

    /// An observer of a minimisation on these grids, coarsest first.
    pub fn observer<const D: usize>(&self, grids: &[Grid<D>]) -> ProgressObserver<'_> {
        let sizes = grids.iter().map(|grid| GridSize {
            side: longest(grid),
            nodes: grid.n_nodes(),
        });
        ProgressObserver::new(&self.progress, self.interrupt.clone(), sizes.collect())
    }

    /// An observer of the solution of equations on one grid.
    pub fn equation_observer<const D: usize>(&self, grid: &Grid<D>) -> ProgressObserver<'_> {
        self.observer(&[*grid]).of_equations()
    }

    /// The checkpoints of a computation with this fingerprint, and those to resume from.
    ///
    /// # Errors
    /// [`CliError::OtherWork`] for checkpoints of another computation with the same output.
    pub fn checkpointer(&self, fingerprint: Fingerprint) -> Result<Checkpointer<'_>, CliError> {
        let place = Place {
            target: self.output,
            fingerprint,
            minutes: self.checkpoint.minutes,
        };
        if self.is_first() {
            Checkpointer::new(place, &self.progress, self.interrupt.clone())
        } else {
            Ok(Checkpointer::without(
                place,
                &self.progress,
                self.interrupt.clone(),
            ))
        }
    }

    /// The distribution of parts of the computation to the processes.
    pub fn distribution(&self, n_parts: usize) -> Distribution {
        Distribution::over(Arc::clone(&self.processes), n_parts)
    }

    /// Whether this process reads, reports and writes.
    pub fn is_first(&self) -> bool {
        self.processes.rank() == 0
    }

    /// Ends the checkpoints of a computation, which are removed when its result is written, and kept if that was
    /// interrupted.
    pub fn ended(&self, checkpointer: Checkpointer<'_>) {
        let work = checkpointer.finish();
        *self.obsolete.lock().unwrap_or_else(PoisonError::into_inner) = work;
    }
}

/// A command that reads inputs of either dimension and writes a result directory.
pub(crate) trait Command: Sync {
    /// Inputs that are read and checked, and the parameters with all defaults resolved.
    type Plan<const D: usize>: Send;
    /// The result of the computation.
    type Outcome<const D: usize>: Send + 'static;

    /// Reads and checks the inputs.
    ///
    /// # Errors
    /// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
    fn plan(&self, session: &Session<'_>) -> Result<PlanOf<Self>, CliError>;

    /// Computes the result.
    ///
    /// # Errors
    /// [`CliError`] where there is no result to be written.
    fn compute<const D: usize>(
        &self,
        plan: Self::Plan<D>,
        session: &Session<'_>,
    ) -> Result<Self::Outcome<D>, CliError>;

    /// Whether several processes can compute a result together.
    const DISTRIBUTED: bool = false;

    /// Takes part in the computation of a result that the first process writes. Called on the other
    /// processes of a command that is [distributed](Self::DISTRIBUTED).
    ///
    /// # Errors
    /// As [`Command::compute`].
    fn assist<const D: usize>(
        &self,
        _plan: Self::Plan<D>,
        _session: &Session<'_>,
    ) -> Result<(), CliError> {
        Ok(())
    }

    /// A directory of finished work that becomes the result directory.
    fn work<const D: usize>(_outcome: &mut Self::Outcome<D>) -> Option<WorkDir> {
        None
    }

    /// Writes all files of the result, and summarises it.
    ///
    /// # Errors
    /// [`CliError`]; the directory is incomplete then.
    fn write<const D: usize>(
        &self,
        outcome: &Self::Outcome<D>,
        session: &Session<'_>,
        directory: &ResultDir,
    ) -> Result<Summary, CliError>;
}

/// The plan of a command in either dimension.
pub(crate) type PlanOf<C> = Dim<<C as Command>::Plan<2>, <C as Command>::Plan<3>>;

/// Options of a command that is its own configuration.
#[derive(Clone, Debug, Args)]
pub(crate) struct ComputeArgs<C: Config> {
    /// Parameters of the computation.
    #[command(flatten)]
    config: Configured<C>,
    /// Options that do not influence the results.
    #[command(flatten)]
    run: RunOptions,
}

impl<C: Config + Command> ComputeArgs<C> {
    /// Runs the command.
    ///
    /// # Errors
    /// [`CliError`]; then no result has been written.
    pub fn run(&self) -> Result<Exit, CliError> {
        logged(&self.run, || {
            self.config
                .run(|config| run(&config, &self.run, CheckpointOption::NONE))
        })
    }
}

/// Options of such a command that stores checkpoints.
#[derive(Clone, Debug, Args)]
pub(crate) struct LongArgs<C: Config> {
    #[command(flatten)]
    compute: ComputeArgs<C>,
    #[command(flatten)]
    checkpoint: CheckpointOption,
}

impl<C: Config + Command> LongArgs<C> {
    /// Runs the command.
    ///
    /// # Errors
    /// [`CliError`]; then no result has been written.
    pub fn run(&self) -> Result<Exit, CliError> {
        let ComputeArgs {
            config,
            run: options,
        } = &self.compute;
        logged(options, || {
            config.run(|config| run(&config, options, self.checkpoint))
        })
    }
}

/// Runs a command from the inputs to the exit code.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub(crate) fn run<C: Command>(
    command: &C,
    options: &RunOptions,
    checkpoint: CheckpointOption,
) -> Result<Exit, CliError> {
    if !C::DISTRIBUTED {
        need_one("this computation")?;
    }
    let start = Instant::now();
    let processes = processes();
    let session = Session {
        progress: if processes.rank() == 0 {
            options.progress(start)
        } else {
            Progress::hidden()
        },
        interrupt: Interrupt::new(),
        start,
        trust: options.trust,
        checkpoint,
        processes,
        ..Session::alone(&options.output)
    };
    in_pool(options.threads, || {
        if session.is_first() {
            // Fail before the computation if the directory cannot be written.
            ResultDir::create(session.output).map(drop)?;
        }
        let summary = match command.plan(&session)? {
            Dim::D2(plan) => execute(command, plan, &session),
            Dim::D3(plan) => execute(command, plan, &session),
        }?;
        let Some(summary) = summary else {
            return Ok(Exit::Success);
        };
        Ok(concluded(&summary, options, start))
    })
}

/// Runs a command from its configuration on, so that its errors, those of its options and files, too, are in the log
/// where there is one.
///
/// # Errors
/// Those of the command; [`CliError::Reported`] for one that is in the log.
pub(crate) fn logged(
    options: &RunOptions,
    run: impl FnOnce() -> Result<Exit, CliError>,
) -> Result<Exit, CliError> {
    let start = Instant::now();
    match (run(), options.log) {
        // The last line of the log instead of a report.
        (Err(error), Some(LogFormat::Json)) => {
            log::error(start, &error);
            Err(CliError::Reported(error.exit()))
        }
        (done, _) => done,
    }
}

/// The exit code of a written result, which is told to other programs.
pub(crate) fn concluded(summary: &Summary, options: &RunOptions, start: Instant) -> Exit {
    let exit = exit(summary, options.allow_doubtful);
    if options.log == Some(LogFormat::Json) {
        log::result(start, &options.output, summary.doubts.len(), exit);
    }
    exit
}

/// The exit code of a written result.
fn exit(summary: &Summary, allow_doubtful: bool) -> Exit {
    if summary.interrupted {
        Exit::Interrupted
    } else if summary.doubts.is_empty() || allow_doubtful {
        Exit::Success
    } else {
        Exit::Doubtful
    }
}

/// Computes and writes the result of a plan; the first process writes it.
fn execute<C: Command, const D: usize>(
    command: &C,
    plan: C::Plan<D>,
    session: &Session<'_>,
) -> Result<Option<Summary>, CliError> {
    if !session.is_first() {
        return command.assist(plan, session).map(|()| None);
    }
    let mut outcome = command.compute(plan, session)?;
    session.progress.stage("writing");
    session.interrupt.writing();
    let written = write_result(command, &mut outcome, session);
    let mut obsolete = session
        .obsolete
        .lock()
        .unwrap_or_else(PoisonError::into_inner);
    let work = obsolete.take();
    let (summary, target) = match written {
        Ok(written) => written,
        Err(error) => {
            // Another process has written this result: from these checkpoints nothing goes on.
            let is_taken = matches!(error, CliError::Output(OutputError::Exists { .. }));
            if let Some(work) = work.filter(|_| is_taken) {
                let _ = work.remove();
            }
            return Err(error);
        }
    };
    match &work {
        Some(work) if summary.interrupted => session.progress.note(format!(
            "the same command goes on from the checkpoint in '{}'",
            work.path().display()
        )),
        _ => work.map_or(Ok(()), WorkDir::remove)?,
    }
    session.progress.finish();
    summary.print(&target);
    Ok(Some(summary))
}

/// Writes the result under its name; returns its summary and its place.
fn write_result<C: Command, const D: usize>(
    command: &C,
    outcome: &mut C::Outcome<D>,
    session: &Session<'_>,
) -> Result<(Summary, PathBuf), CliError> {
    let directory = match C::work(outcome) {
        Some(work) => work.into_result(),
        None => ResultDir::create(session.output)?,
    };
    let summary = command.write(outcome, session, &directory)?;
    write_page(&directory, &summary, Some(&command_line()))?;
    seal(&directory)?;
    Ok((summary, directory.commit()?))
}
