//! Initial deformations of a run: those of an earlier result, and checkpoints.
//!
//! A checkpoint of L-BFGS has its memory: a run that resumes from it repeats the runs before, on
//! coarser grids, and continues this one to the bits of a run without interruption. A checkpoint of
//! other solvers has deformations, which are the start of a run on their grid.
//!
//! A long run stores its current deformations in `DIR.partial`, next to its output, every few
//! minutes. After an interruption the same command resumes from there; after a regular end the
//! folder is removed. Each checkpoint is a folder of its own, and `state.json` has the number of
//! the last complete one.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use fe_grid::minimise::{Control, Iteration, Memory, Observer};
use fe_grid::{Field, Grid};
use serde::{Deserialize, Serialize};

use super::args::{AverageConfig, AverageRun};
use super::remembered::Remembered;
use crate::error::CliError;
use crate::fingerprint::{Fingerprint, hash};
use crate::history::HistoryPoint;
use crate::integrity::Sums;
use crate::output::npy::{Precision, write_field};
use crate::output::{OutputError, WorkDir, deformation, numbered, sync};
use crate::progress::Progress;
use crate::report::RESULT;
use crate::results::{ResultFields, read_record};
use crate::shapes::VisibilityMask;
use crate::watch::ProgressObserver;
use shapespace_input::Image;
use shapespace_input::frame::FrameTransform;

const STATE: &str = "state.json";

/// The inputs and parameters that the deformations depend on.
pub(super) fn fingerprint<const D: usize>(
    config: &AverageConfig,
    images: &[Image<D>],
    views: &[Option<VisibilityMask<D>>],
) -> Fingerprint {
    let views = views.iter().flatten().map(|mask| hash(&mask.image));
    Fingerprint::new(config, images.iter().map(hash).chain(views).collect())
}

/// The record of a checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    /// Its number, which names the folder of its files.
    checkpoint: usize,
    /// Nodes along each axis, `x` first.
    nodes: Vec<usize>,
    energy: f64,
    /// Work up to the checkpoint, summed over all runs.
    seconds: f64,
    /// The checksums of its files.
    sums: Sums,
    /// The memory of L-BFGS; without it the files are deformations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    memory: Option<Remembered>,
}

/// How a run is resumed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Resumption {
    /// From the memory of L-BFGS.
    Exact,
    /// From the deformations.
    Restart,
}

/// Location and interval of the checkpoints of a run.
struct Place<'a> {
    /// The output of the run.
    target: &'a Path,
    /// The inputs and parameters that it depends on.
    fingerprint: Fingerprint,
    /// Minutes between two checkpoints; `None` disables them.
    minutes: f64,
}

/// Observes a run and stores checkpoints of its deformations.
pub(super) struct Checkpointer<'a, const D: usize> {
    watch: ProgressObserver<'a>,
    place: Place<'a>,
    /// All grids of the run.
    grids: Vec<Grid<D>>,
    /// For every shape whether it is part of the minimisation: shapes of weight zero are deformed
    /// onto the average afterwards.
    leads: Vec<bool>,
    resumption: Resumption,
    /// Runs of L-BFGS so far.
    runs: usize,
    /// The run to resume, with its memory.
    pending: Option<(usize, Memory<'static>, Vec<HistoryPoint>)>,
    work: Option<WorkDir>,
    /// The existing checkpoint.
    last: Option<State>,
    count: usize,
    /// Work of earlier runs.
    before: f64,
    begin: Instant,
    kept: Instant,
}

impl<'a, const D: usize> Checkpointer<'a, D> {
    /// Opens the checkpoint of the same run, if there is one: returns the observer and the
    /// deformations to resume from, `None` without a checkpoint.
    ///
    /// # Errors
    /// [`CliError::OtherWork`] for a checkpoint of another run of the same name.
    fn new(
        watch: ProgressObserver<'a>,
        place: Place<'a>,
        grids: Vec<Grid<D>>,
        leads: Vec<bool>,
        resumption: Resumption,
    ) -> Result<(Self, Vec<Field<f64, D, D>>), CliError> {
        let now = Instant::now();
        let mut checkpointer = Self {
            watch,
            place,
            grids,
            leads,
            resumption,
            runs: 0,
            pending: None,
            work: None,
            last: None,
            count: 0,
            before: 0.0,
            begin: now,
            kept: now,
        };
        let mut known = Vec::new();
        if WorkDir::exists(checkpointer.place.target) {
            let work = checkpointer
                .place
                .fingerprint
                .work_dir(checkpointer.place.target)?;
            known = checkpointer.resume(&work)?;
            checkpointer.work = Some(work);
        }
        Ok((checkpointer, known))
    }

    /// The deformations of the last checkpoint; none where there is none, or where it is damaged: it
    /// is then set aside.
    fn resume(&mut self, work: &WorkDir) -> Result<Vec<Field<f64, D, D>>, CliError> {
        if !work.file(STATE).exists() {
            return Ok(Vec::new());
        }
        let damage = match work.get::<State>(STATE) {
            None => format!("its {STATE} cannot be read"),
            Some(state) => match self.read(work, &state) {
                Ok(known) => {
                    self.watch.note(format!(
                        "going on from the checkpoint in '{}': {} nodes a side, energy {:.6e}, after \
                         {:.1} minutes",
                        work.path().display(),
                        state.nodes.first().copied().unwrap_or(0),
                        state.energy,
                        state.seconds / 60.0
                    ));
                    self.before = state.seconds;
                    if let Some((memory, remembered)) = known.1.zip(state.memory.as_ref()) {
                        let history = remembered.history.clone();
                        self.pending = Some((remembered.run, memory, history));
                    }
                    self.count = state.checkpoint.wrapping_add(1);
                    self.last = Some(state);
                    return Ok(known.0);
                }
                Err(error) => error.to_string(),
            },
        };
        let aside = work.set_aside()?;
        self.watch.note(format!(
            "warning: the checkpoint is damaged ({damage}); it is kept in '{}' until the result is \
             written, and the computation begins anew",
            aside.display()
        ));
        Ok(Vec::new())
    }

    /// The deformations of a checkpoint, or its memory.
    fn read(
        &self,
        work: &WorkDir,
        state: &State,
    ) -> Result<(Vec<Field<f64, D, D>>, Option<Memory<'static>>), CliError> {
        let folder = work.file(folder(state.checkpoint));
        if let Some(remembered) = &state.memory {
            let memory = remembered.load(&folder, &state.sums)?;
            return Ok((Vec::new(), Some(memory)));
        }
        let fields = ResultFields::listed(&folder, unfit, state.sums.clone());
        let known = deformations(&folder, &fields, self.leads.len(), &self.grids)?;
        Ok((known, None))
    }

    /// The convergence history, and the folder of the checkpoints, if there are any, to be removed
    /// when the result is written.
    pub fn finish(self) -> (Vec<HistoryPoint>, Option<WorkDir>) {
        // Interrupted before the run to resume: the checkpoint is beyond the result.
        let work = self.work.filter(|_| self.pending.is_none());
        (self.watch.finish(), work)
    }

    /// Stores deformations.
    fn keep(&mut self, iteration: &Iteration<'_>) -> Result<(), CliError> {
        let n = self.leads.iter().filter(|leads| **leads).count();
        let fits = |grid: &&Grid<D>| n * D * grid.n_nodes() == iteration.x.len();
        let Some(&grid) = self.grids.iter().find(fits) else {
            return Ok(());
        };
        let folder = self.next_folder()?;
        let mut led = iteration.x.chunks_exact(D * grid.n_nodes());
        for (i, leads) in self.leads.iter().enumerate() {
            let own = if *leads { led.next() } else { None };
            let displacement = match own {
                Some(u) => Field::from_vec(grid, u.to_vec())?,
                None => Field::zeros(grid),
            };
            let path = folder.join(numbered("deformation", i, "npy"));
            write_field(&path, &deformation(&displacement), Precision::Double)?;
            sync(&path)?;
        }
        sync(&folder)?;
        self.complete(&folder, iteration.energy, None)
    }

    /// Stores the memory of a minimiser.
    fn keep_memory(&mut self, memory: &Memory<'_>) -> Result<(), CliError> {
        let folder = self.next_folder()?;
        let remembered = Remembered::save(&folder, self.runs, memory, self.watch.history())?;
        self.complete(&folder, remembered.energy(), Some(remembered))
    }

    /// A new folder for a checkpoint.
    fn next_folder(&mut self) -> Result<PathBuf, CliError> {
        let work = match self.work.take() {
            Some(work) => work,
            None => self.place.fingerprint.work_dir(self.place.target)?,
        };
        let work = self.work.insert(work);
        let folder = folder(self.count);
        // Left incomplete by an interruption.
        remove(&work.file(&folder))?;
        work.folder(&folder)?;
        Ok(work.file(&folder))
    }

    /// States that a checkpoint is complete, and removes the one before it.
    fn complete(
        &mut self,
        complete: &Path,
        energy: f64,
        memory: Option<Remembered>,
    ) -> Result<(), CliError> {
        let state = State {
            sums: Sums::compute(complete).map_err(OutputError::at(complete))?,
            checkpoint: self.count,
            nodes: vec![self.watch.nodes(); D],
            energy,
            seconds: self.before + self.begin.elapsed().as_secs_f64(),
            memory,
        };
        if let Some(work) = &self.work {
            work.put(STATE, &state)?;
            if let Some(old) = self.last.replace(state) {
                remove(&work.file(folder(old.checkpoint)))?;
            }
        }
        self.count = self.count.wrapping_add(1);
        Ok(())
    }

    /// Stores a checkpoint if it is time for one of this kind.
    fn store(&mut self, kind: Resumption, keep: impl FnOnce(&mut Self) -> Result<(), CliError>) {
        let due = 60.0 * self.place.minutes;
        // What is repeated until the run to resume is older than the existing checkpoint.
        let is_new = self.pending.is_none();
        let is_due = due > 0.0 && self.kept.elapsed().as_secs_f64() >= due;
        if kind == self.resumption && is_new && is_due {
            // A checkpoint is useful only after an interruption: a failure to write it does not end
            // the run.
            if let Err(error) = keep(self) {
                self.watch.note(format!("warning: no checkpoint: {error}"));
            }
            self.kept = Instant::now();
        }
    }
}

impl<const D: usize> Observer for Checkpointer<'_, D> {
    fn level(&mut self, level: usize, n_levels: usize, dim: usize) {
        self.watch.level(level, n_levels, dim);
    }

    fn resume(&mut self) -> Option<Memory<'static>> {
        self.runs += 1;
        let (_, memory, history) = self.pending.take_if(|(run, ..)| *run == self.runs)?;
        self.watch.restore(history);
        Some(memory)
    }

    fn memory(&mut self, memory: &Memory<'_>) {
        self.store(Resumption::Exact, |this| this.keep_memory(memory));
    }

    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        self.store(Resumption::Restart, |this| this.keep(iteration));
        self.watch.iteration(iteration)
    }

    fn between(&mut self) -> Control {
        self.watch.between()
    }
}

fn remove(folder: &Path) -> Result<(), OutputError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(OutputError::at(folder)(error))
        }
        _ => Ok(()),
    }
}

/// The folder of a checkpoint. Names are made of numbers, so that nothing that a file states can
/// name a folder elsewhere.
fn folder(checkpoint: usize) -> String {
    format!("checkpoint_{checkpoint:03}")
}

fn unfit(path: &Path, reason: String) -> CliError {
    CliError::NoResult {
        path: path.into(),
        command: "average",
        reason,
    }
}

/// The displacements of an earlier average of the same number of shapes, on one of these grids.
///
/// # Errors
/// [`CliError::NoResult`] if they are missing or on another grid.
fn deformations<const D: usize>(
    directory: &Path,
    fields: &ResultFields<'_>,
    n_shapes: usize,
    grids: &[Grid<D>],
) -> Result<Vec<Field<f64, D, D>>, CliError> {
    let exists = |i: usize| directory.join(numbered("deformation", i, "npy")).is_file();
    let mut found = 0;
    while exists(found) {
        found += 1;
    }
    if found != n_shapes {
        let reason = format!("it has {found} deformations, and there are {n_shapes} inputs");
        return Err(unfit(directory, reason));
    }
    let nodes = fields.nodes(&numbered("deformation", 0, "npy"))?;
    let Some(grid) = grids.iter().find(|g| g.nodes_per_axis()[..] == nodes[..]) else {
        let sides: Vec<String> = grids
            .iter()
            .map(|g| g.nodes_per_axis()[0].to_string())
            .collect();
        let reason = format!(
            "its deformations have {nodes:?} nodes, and the grids of this run have {} nodes a side",
            sides.join(", ")
        );
        return Err(unfit(directory, reason));
    };
    let read = |i| fields.displacement(grid, "deformation", i);
    (0..n_shapes).map(read).collect()
}

/// Whether the inputs of an earlier average had the same placement, if its record states it.
fn same_placement<const D: usize>(directory: &Path, frames: &[FrameTransform<D>]) -> bool {
    if !directory.join(RESULT).exists() {
        return true;
    }
    let record = read_record::<AverageConfig, (), D>(directory);
    record.is_ok_and(|record| {
        let mut all = record.input.iter().zip(frames);
        record.input.len() == frames.len() && all.all(|(a, b)| a.frame.like(b))
    })
}

/// The observer of a run, and its initial deformations: those of its checkpoint, else those of the
/// average that `--start` names, `None` without either.
///
/// # Errors
/// Those of [`Checkpointer::new`], [`CliError::NoResult`] for a start that does not fit, and
/// [`CliError::Damaged`] for one that has changed.
pub(super) fn begin<'a, const D: usize>(
    start: Option<&Path>,
    run: &'a AverageRun,
    fingerprint: Fingerprint,
    grids: Vec<Grid<D>>,
    leads: Vec<bool>,
    resumption: Resumption,
    watch: ProgressObserver<'a>,
) -> Result<(Checkpointer<'a, D>, Vec<Field<f64, D, D>>), CliError> {
    let started = match start {
        Some(directory) => {
            let fields = ResultFields::new(directory, unfit, run.common.trust)?;
            deformations(directory, &fields, leads.len(), &grids)?
        }
        None => Vec::new(),
    };
    let place = Place {
        target: &run.common.output,
        fingerprint,
        minutes: run.checkpoint,
    };
    let (checkpointer, kept) = Checkpointer::new(watch, place, grids, leads, resumption)?;
    Ok((checkpointer, if kept.is_empty() { started } else { kept }))
}

/// Warns if the inputs of the average that `--start` names had another placement.
pub(super) fn compare_places<const D: usize>(
    start: Option<&Path>,
    frames: impl Iterator<Item = FrameTransform<D>>,
    progress: &Progress,
) {
    let frames: Vec<_> = frames.collect();
    if let Some(directory) = start.filter(|directory| !same_placement(directory, &frames)) {
        progress.note(format!(
            "warning: the inputs of '{}' lay elsewhere in the box: its deformations fit badly",
            directory.display()
        ));
    }
}
