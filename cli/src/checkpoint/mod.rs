//! Checkpoints of long computations.
//!
//! A long run stores its state in `DIR.partial`, next to its output, every few minutes. After an
//! interruption the same command resumes from there; after a regular end the folder is removed.
//!
//! A computation is a sequence of runs of solvers: of L-BFGS on grids from coarse to fine, of equations,
//! of linear systems. A checkpoint has the results of all runs that have ended, and the memory of the one
//! that has not. The same command, started again, goes through all of its runs to the bits of the first
//! time: it takes the results of those that have ended, and resumes the other from its memory.

mod remembered;
mod store;

use std::collections::BTreeSet;
use std::path::Path;

use fe_grid::Grid;
use fe_grid::minimise::{Control, Iteration, Memory, Observer};

use crate::error::CliError;
use crate::grid::longest;
use crate::history::HistoryPoint;
use crate::interrupt::Interrupt;
use crate::output::WorkDir;
use crate::progress::Progress;
use crate::watch::ProgressObserver;
use remembered::Remembered;
use store::{Kept, Progressed, Store};

pub(crate) use store::Place;

/// Results of this many bytes are kept in memory until the next checkpoint; more are stored at once.
const MOST_UNSAVED: usize = 64 << 20;

/// A computation of independent parts numbers the runs of a part from a multiple of this, which is the number
/// of the result of the part. No part has so many.
const RUNS_OF_PART: usize = 1 << 20;

/// The checkpoints of a computation.
pub(crate) struct Checkpointer<'a> {
    progress: &'a Progress,
    interrupt: Interrupt,
    store: Store<'a>,
    /// Runs so far.
    runs: usize,
    /// The runs to resume.
    pending: BTreeSet<usize>,
    /// Results that are in no checkpoint yet.
    unsaved: Vec<Unsaved>,
}

/// The result of a run.
struct Unsaved {
    run: usize,
    memory: Memory<'static>,
    history: Vec<HistoryPoint>,
    /// Nodes a side of its grid.
    nodes: usize,
}

impl<'a> Checkpointer<'a> {
    /// Opens the checkpoints of the same computation, if there are any.
    ///
    /// # Errors
    /// [`CliError::OtherWork`] for checkpoints of another computation of the same name.
    pub fn new(
        place: Place<'a>,
        progress: &'a Progress,
        interrupt: Interrupt,
    ) -> Result<Self, CliError> {
        let store = Store::open(place, progress)?;
        let pending = store.parts().map(|part| part.run).collect();
        Ok(Self {
            progress,
            interrupt,
            store,
            runs: 0,
            pending,
            unsaved: Vec::new(),
        })
    }

    /// No checkpoints: another process stores them.
    pub fn without(place: Place<'a>, progress: &'a Progress, interrupt: Interrupt) -> Self {
        Self {
            progress,
            interrupt,
            store: Store::none(place),
            runs: 0,
            pending: BTreeSet::new(),
            unsaved: Vec::new(),
        }
    }

    /// Whether there are runs to resume.
    pub fn has_runs(&self) -> bool {
        !self.pending.is_empty()
    }

    /// Goes on to one of several parts of the computation that are independent of each other, in any order;
    /// returns its result, if it is known. If not, its runs follow.
    pub fn part(&mut self, part: usize) -> Option<Memory<'static>> {
        self.runs = part * RUNS_OF_PART;
        if !self.pending.remove(&self.runs) {
            return None;
        }
        let (memory, _) = self.load()?;
        Some(memory)
    }

    /// Takes the result of a part, which replaces all that is known of its runs. A failure to store it does not
    /// end the computation.
    pub fn keep_part<const D: usize>(
        &mut self,
        part: usize,
        memory: &Memory<'_>,
        grids: &[Grid<D>],
    ) {
        self.runs = part * RUNS_OF_PART;
        if self.interrupt.asked() {
            return;
        }
        let is_of_part = |run: usize| run / RUNS_OF_PART == part;
        self.pending.retain(|run| !is_of_part(*run));
        self.unsaved.retain(|old| !is_of_part(old.run));
        let nodes = grids.last().map_or(0, longest);
        if !self.store.is_enabled() || !self.store.is_due() && self.keep(memory, &[], nodes) {
            return;
        }
        if let Err(error) = self.store(memory, &[], nodes) {
            self.progress
                .note(format!("warning: no checkpoint: {error}"));
        }
    }

    /// Observes a part of the computation, and shows its progress as another observer does.
    pub fn observe<'b>(&'b mut self, watch: ProgressObserver<'b>) -> Checked<'b, 'a> {
        Checked {
            checkpointer: self,
            watch,
            first: 0,
        }
    }

    /// The folder of the checkpoints, if there are any, to be removed when the whole result is written. After an
    /// interruption it has the results of all runs that have ended.
    pub fn finish(mut self) -> Option<WorkDir> {
        let is_kept = self.interrupt.asked() && self.store.is_enabled();
        if let Some(last) = self.unsaved.pop().filter(|_| is_kept) {
            self.runs = last.run;
            if let Err(error) = self.store(&last.memory, &last.history, last.nodes) {
                self.progress
                    .note(format!("warning: no checkpoint: {error}"));
            }
        }
        self.store.into_work()
    }

    /// The memory to resume this run from.
    fn load(&self) -> Option<(Memory<'static>, Vec<HistoryPoint>)> {
        let (folder, sums, part) = self.store.find(self.runs)?;
        match part.load(&folder, sums) {
            Ok(memory) => Some((memory, part.history.clone())),
            Err(error) => {
                self.progress
                    .note(format!("warning: a checkpoint is not used: {error}"));
                None
            }
        }
    }

    /// Keeps a result until the next checkpoint; `false` where there is no room.
    fn keep(&mut self, memory: &Memory<'_>, history: &[HistoryPoint], nodes: usize) -> bool {
        let run = self.runs;
        self.unsaved.retain(|old| old.run != run);
        let unsaved: usize = self.unsaved.iter().map(|old| old.memory.bytes()).sum();
        let has_room = unsaved + memory.bytes() <= MOST_UNSAVED;
        if has_room {
            self.unsaved.push(Unsaved {
                run,
                memory: memory.clone().into_owned(),
                history: history.to_vec(),
                nodes,
            });
        }
        has_room
    }

    /// Stores all results that are in no checkpoint yet, and a memory of this run.
    fn store(
        &mut self,
        memory: &Memory<'_>,
        history: &[HistoryPoint],
        nodes: usize,
    ) -> Result<(), CliError> {
        for old in std::mem::take(&mut self.unsaved) {
            if old.run != self.runs {
                self.add(old.run, &old.memory, &old.history, old.nodes)?;
            }
        }
        self.add(self.runs, memory, history, nodes)
    }

    fn add(
        &mut self,
        run: usize,
        memory: &Memory<'_>,
        history: &[HistoryPoint],
        nodes: usize,
    ) -> Result<(), CliError> {
        let at = Progressed {
            nodes,
            energy: memory.energies.last().copied(),
        };
        let write = |folder: &Path| Ok(Remembered::save(folder, run, memory, history)?);
        self.store.add(at, write, retire)
    }
}

/// An observer of a part of a computation that stores checkpoints.
pub(crate) struct Checked<'b, 'a> {
    checkpointer: &'b mut Checkpointer<'a>,
    watch: ProgressObserver<'b>,
    /// Length of the convergence history before this run.
    first: usize,
}

impl Checked<'_, '_> {
    /// The convergence history.
    pub fn finish(self) -> Vec<HistoryPoint> {
        self.watch.finish()
    }
}

impl Observer for Checked<'_, '_> {
    fn level(&mut self, level: usize, n_levels: usize, dim: usize) {
        self.watch.level(level, n_levels, dim);
    }

    fn resume(&mut self) -> Option<Memory<'static>> {
        let all = &mut *self.checkpointer;
        all.runs += 1;
        self.first = self.watch.history().len();
        if !all.pending.remove(&all.runs) {
            return None;
        }
        let (memory, history) = all.load()?;
        self.watch.restore(history);
        Some(memory)
    }

    fn memory(&mut self, memory: &Memory<'_>) {
        let all = &mut *self.checkpointer;
        // What is repeated before the last run to resume is older than the checkpoints; what follows an interruption
        // begins with a run that has not ended.
        if !all.store.is_enabled() || !all.pending.is_empty() || all.interrupt.asked() {
            return;
        }
        let history = &self.watch.history()[self.first..];
        let nodes = self.watch.nodes();
        if !all.store.is_due() && (memory.ended.is_none() || all.keep(memory, history, nodes)) {
            return;
        }
        // A checkpoint is useful only after an interruption: a failure to write it does not end the
        // computation.
        if let Err(error) = all.store(memory, history, nodes) {
            self.watch.note(format!("warning: no checkpoint: {error}"));
        }
    }

    fn remembers(&mut self, ended: bool) -> bool {
        let all = &*self.checkpointer;
        all.store.is_enabled() && all.pending.is_empty() && (ended || all.store.is_due())
    }

    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        self.watch.iteration(iteration)
    }

    fn between(&mut self) -> Control {
        self.watch.between()
    }
}

/// Drops what the newest checkpoint replaces: that of the same run, of the runs of a part that it is the
/// result of, and memories of runs that have not ended there.
fn retire(kept: &mut Vec<Kept>) {
    let Some(new) = kept.pop() else { return };
    let is_replaced = |run: usize| {
        let is_result = new.part.run.is_multiple_of(RUNS_OF_PART);
        run == new.part.run || is_result && run / RUNS_OF_PART == new.part.run / RUNS_OF_PART
    };
    kept.retain(|one| one.part.ended.is_some() && !is_replaced(one.part.run));
    kept.push(new);
}
