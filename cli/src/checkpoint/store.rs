//! Checkpoints in `DIR.partial`: a folder each, and `state.json`, which says what they hold.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::remembered::Remembered;
use crate::error::CliError;
use crate::fingerprint::Fingerprint;
use crate::integrity::Sums;
use crate::output::{OutputError, WorkDir};
use crate::progress::Progress;

const STATE: &str = "state.json";

/// Location and interval of the checkpoints of a run.
pub(crate) struct Place<'a> {
    /// The output of the run.
    pub target: &'a Path,
    /// The inputs and parameters that it depends on.
    pub fingerprint: Fingerprint,
    /// Minutes between two checkpoints; 0 disables them.
    pub minutes: f64,
}

/// A complete checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Kept {
    /// Its number, which names the folder of its files.
    checkpoint: usize,
    /// The checksums of its files.
    sums: Sums,
    /// What its files do not hold.
    pub part: Remembered,
}

/// The record of all checkpoints.
#[derive(Debug, Serialize, Deserialize)]
struct State {
    /// The number of the last one.
    checkpoint: usize,
    /// Nodes a side there.
    nodes: usize,
    /// The energy there, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    energy: Option<f64>,
    /// Work up to there, summed over all runs of the program.
    seconds: f64,
    /// All that are there, oldest first.
    kept: Vec<Kept>,
}

/// Where a run is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Progressed {
    /// Nodes a side.
    pub nodes: usize,
    /// The energy, where there is one.
    pub energy: Option<f64>,
}

/// The checkpoints of a run.
pub(super) struct Store<'a> {
    place: Place<'a>,
    work: Option<WorkDir>,
    kept: Vec<Kept>,
    next: usize,
    /// Work of earlier runs of the program.
    before: f64,
    begin: Instant,
    last: Instant,
}

impl<'a> Store<'a> {
    /// Opens the checkpoints of the same computation, if there are any. Where one is damaged, all are set
    /// aside.
    ///
    /// # Errors
    /// [`CliError::OtherWork`] for checkpoints of another run of the same name.
    pub fn open(place: Place<'a>, progress: &Progress) -> Result<Self, CliError> {
        let mut store = Self::none(place);
        if WorkDir::exists(store.place.target) {
            let work = store.place.fingerprint.work_dir(store.place.target)?;
            store.resume(&work, progress)?;
            store.work = Some(work);
        }
        Ok(store)
    }

    /// No checkpoints yet.
    pub fn none(place: Place<'a>) -> Self {
        let now = Instant::now();
        Self {
            place,
            work: None,
            kept: Vec::new(),
            next: 0,
            before: 0.0,
            begin: now,
            last: now,
        }
    }

    fn resume(&mut self, work: &WorkDir, progress: &Progress) -> Result<(), CliError> {
        if !work.file(STATE).exists() {
            return Ok(());
        }
        let damage = match work.get::<State>(STATE) {
            None => format!("its {STATE} cannot be read"),
            Some(state) => {
                let mut all = state.kept.iter();
                let read = all.try_for_each(|one| {
                    let folder = work.path().join(folder(one.checkpoint));
                    one.part.load(&folder, &one.sums).map(drop)
                });
                match read {
                    Ok(()) => {
                        progress.note(format!(
                            "going on from the checkpoint in '{}': {} nodes a side{}, after {:.1} minutes",
                            work.path().display(),
                            state.nodes,
                            state
                                .energy
                                .map(|energy| format!(", energy {energy:.6e}"))
                                .unwrap_or_default(),
                            state.seconds / 60.0
                        ));
                        self.before = state.seconds;
                        self.next = state.checkpoint.wrapping_add(1);
                        self.kept = state.kept;
                        return Ok(());
                    }
                    Err(error) => error.to_string(),
                }
            }
        };
        let aside = work.set_aside()?;
        progress.note(format!(
            "warning: the checkpoint is damaged ({damage}); it is kept in '{}' until the result is \
             written, and the computation begins anew",
            aside.display()
        ));
        Ok(())
    }

    /// What the checkpoints hold, oldest first.
    pub fn parts(&self) -> impl Iterator<Item = &Remembered> {
        self.kept.iter().map(|one| &one.part)
    }

    /// The folder of the checkpoint of a run, with the checksums of its files.
    pub fn find(&self, run: usize) -> Option<(PathBuf, &Sums, &Remembered)> {
        let work = self.work.as_ref()?;
        let one = self.kept.iter().rfind(|one| one.part.run == run)?;
        Some((
            work.path().join(folder(one.checkpoint)),
            &one.sums,
            &one.part,
        ))
    }

    /// Whether checkpoints are stored at all.
    pub fn is_enabled(&self) -> bool {
        self.place.minutes > 0.0
    }

    /// Whether it is time for a checkpoint.
    pub fn is_due(&self) -> bool {
        self.is_enabled() && self.last.elapsed().as_secs_f64() >= 60.0 * self.place.minutes
    }

    /// Stores a checkpoint, whose files `write` writes to a folder; `retire` drops those that it
    /// replaces. Only then these are removed.
    ///
    /// # Errors
    /// [`CliError`] where it cannot be written; those before are still there.
    pub fn add(
        &mut self,
        at: Progressed,
        write: impl FnOnce(&Path) -> Result<Remembered, CliError>,
        retire: impl FnOnce(&mut Vec<Kept>),
    ) -> Result<(), CliError> {
        self.last = Instant::now();
        let work = match self.work.take() {
            Some(work) => work,
            None => self.place.fingerprint.work_dir(self.place.target)?,
        };
        let work = self.work.insert(work);
        let (number, name) = (self.next, folder(self.next));
        // Left incomplete by an interruption.
        remove(&work.file(&name))?;
        work.folder(&name)?;
        let path = work.file(&name);
        let part = write(&path)?;
        let new = Kept {
            checkpoint: number,
            sums: Sums::compute(&path).map_err(OutputError::at(&path))?,
            part,
        };
        let mut kept = self.kept.clone();
        kept.push(new);
        retire(&mut kept);
        let state = State {
            checkpoint: number,
            nodes: at.nodes,
            energy: at.energy,
            seconds: self.before + self.begin.elapsed().as_secs_f64(),
            kept,
        };
        work.put(STATE, &state)?;
        self.next = number.wrapping_add(1);
        let before = std::mem::replace(&mut self.kept, state.kept);
        let is_kept = |number| self.kept.iter().any(|one| one.checkpoint == number);
        for old in before.iter().filter(|old| !is_kept(old.checkpoint)) {
            remove(&work.file(folder(old.checkpoint)))?;
        }
        self.last = Instant::now();
        Ok(())
    }

    /// The folder of all checkpoints, if there are any.
    pub fn into_work(self) -> Option<WorkDir> {
        self.work
    }
}

/// The folder of a checkpoint. Names are made of numbers, so that nothing that a file states can
/// name a folder elsewhere.
fn folder(checkpoint: usize) -> String {
    format!("checkpoint_{checkpoint:03}")
}

fn remove(folder: &Path) -> Result<(), OutputError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(OutputError::at(folder)(error))
        }
        _ => Ok(()),
    }
}
