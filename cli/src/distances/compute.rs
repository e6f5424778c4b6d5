//! Computes all paths, several at a time.
//!
//! Each worker has its own threads and processes one pair after the other, so that on small grids
//! no time is lost by dividing the work of a pair. By default as many pairs are processed at the
//! same time as there are threads; the threads are distributed evenly among them. The results do
//! not depend on it: a path is bitwise the same on any number of threads, and pairs are
//! independent. Other [processes](super::helpers) take pairs from the same list.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use ::geodesic::Shape;

use super::args::DistancesConfig;
use super::helpers::lead;
use super::pair::{Detour, Key, PairRecord, Place, Way, compute, compute_through};
use super::store::Store;
use crate::error::CliError;
use crate::interrupt::Interrupt;
use crate::pool::{in_pool, no_threads};
use crate::progress::Progress;
use crate::session::Session;
use crate::shapes::Pairs;

/// Notes during the computation if there is no overwritten line.
const NOTES: usize = 20;

/// The pairs and the parameters of their paths.
pub(super) struct Task<'a, const D: usize> {
    pub pairs: &'a Pairs<D>,
    pub config: &'a DistancesConfig,
    pub store: &'a Store,
    /// Result directories whose paths are taken.
    pub merge: &'a [PathBuf],
    /// Pairs processed at the same time; by default one per thread.
    pub at_once: Option<u32>,
    pub session: &'a Session<'a>,
}

impl<const D: usize> Task<'_, D> {
    /// Takes the paths of these pairs from other results, computes those that are not stored yet, and
    /// returns all in the requested order; `None` if interrupted. Finished pairs are stored.
    ///
    /// # Errors
    /// The first error of a path, and those of files.
    pub fn run(&self, wanted: &[[usize; 2]]) -> Result<Option<Vec<PairRecord>>, CliError> {
        let pairs = wanted.chunks(self.config.directions());
        let ways: Vec<Way> = pairs.map(|pair| Way::direct(pair[0])).collect();
        self.run_ways(&ways)
    }

    /// As [`Task::run`], for all directions of these pairs, directly or from ways through third shapes.
    ///
    /// # Errors
    /// As for [`Task::run`].
    pub fn run_ways(&self, ways: &[Way]) -> Result<Option<Vec<PairRecord>>, CliError> {
        // Both directions of a pair are computed together.
        let directions = self.config.directions();
        let wanted: Vec<Key> = ways.iter().flat_map(|way| way.keys(directions)).collect();
        if !self.merge.is_empty() {
            let taken = self.store.merge(self.merge, &wanted)?;
            let note = format!("{taken} of {} paths are taken", wanted.len());
            self.session.progress.note(note);
        }
        let stored = |(ids, through): Key| self.store.pair(ids, through);
        let is_missing = |way: &&Way| way.keys(directions).any(|key| stored(key).is_none());
        let missing: Vec<Way> = ways.iter().filter(is_missing).copied().collect();
        let before = wanted.len() - directions * missing.len();
        let progress_of_pairs = PairProgress::new(wanted.len(), before);
        progress_of_pairs.show(&self.session.progress);
        self.compute(&missing, &progress_of_pairs)?;
        if self.session.interrupt.asked() {
            return Ok(None);
        }
        let records: Option<Vec<PairRecord>> = wanted.into_iter().map(stored).collect();
        match records {
            Some(records) => Ok(Some(records)),
            None => Err(CliError::Computation {
                message: "files of finished pairs are missing".into(),
                remedy: "repeat the command".into(),
            }),
        }
    }

    fn compute(&self, missing: &[Way], progress_of_pairs: &PairProgress) -> Result<(), CliError> {
        let threads = rayon::current_num_threads();
        let asked = self.at_once.map_or(threads, |n| n as usize);
        let workers = asked.min(threads).min(missing.len());
        let next = AtomicUsize::new(0);
        let stopped = AtomicBool::new(false);
        let failure = Mutex::new(None);
        let worker = |threads: usize| {
            let outcome = in_pool(Some(threads as u32), || {
                while !stopped.load(Ordering::Relaxed) {
                    let Some(way) = missing.get(next.fetch_add(1, Ordering::Relaxed)) else {
                        break;
                    };
                    let paths = self.pair(*way)?;
                    if paths == 0 {
                        break;
                    }
                    for _ in 0..paths {
                        progress_of_pairs.one_more(&self.session.progress);
                    }
                }
                Ok(())
            });
            if let Err(error) = outcome {
                stopped.store(true, Ordering::Relaxed);
                // A worker that panics ends the program, so that the lock is never poisoned here.
                if let Ok(mut first) = failure.lock() {
                    first.get_or_insert(error);
                }
            }
        };
        let helped = std::thread::scope(|scope| {
            for k in 0..workers {
                let share = share(threads, workers, k);
                let work = move || worker(share);
                if let Err(error) = std::thread::Builder::new().spawn_scoped(scope, work) {
                    stopped.store(true, Ordering::Relaxed);
                    return Err(no_threads(&error));
                }
            }
            let hand_out = || missing.get(next.fetch_add(1, Ordering::Relaxed)).copied();
            let ends = || stopped.load(Ordering::Relaxed) || self.session.interrupt.asked();
            let keep = |records: &[PairRecord]| {
                for record in records {
                    self.store.keep(record)?;
                    progress_of_pairs.one_more(&self.session.progress);
                }
                Ok(())
            };
            lead(&*self.session.processes, &hand_out, &keep, &ends)
        });
        match failure.into_inner() {
            Ok(Some(error)) => Err(error),
            _ => helped,
        }
    }

    /// Computes and stores a pair, unless it is interrupted; returns the number of directions.
    fn pair(&self, way: Way) -> Result<usize, CliError> {
        let records = paths_of(self.pairs, way, self.config, &self.session.interrupt)?;
        for record in &records {
            self.store.keep(record)?;
        }
        Ok(records.len())
    }
}

/// The threads of one of several workers: the first have one more if they cannot be divided evenly.
pub(super) fn share(threads: usize, workers: usize, worker: usize) -> usize {
    threads / workers + usize::from(worker < threads % workers)
}

/// Computes the paths of a pair, or those from a way through a third shape; none if they are interrupted. Where some of
/// the first fold or do not arrive, all are
/// computed on finer grids, too: parts and gaps that the grid does not resolve are what most of these
/// fail at. Those of a finer grid are kept where more of them arrive.
pub(super) fn paths_of<const D: usize>(
    pairs: &Pairs<D>,
    Way { ids, detour }: Way,
    config: &DistancesConfig,
    interrupt: &Interrupt,
) -> Result<Vec<PairRecord>, CliError> {
    if let Some(Detour {
        through,
        refinements,
    }) = detour
    {
        let mut place = Place {
            ids,
            magnification: 1.0,
            refinements,
            through: Some(through),
        };
        let placed = pairs.fields_through(ids, through, refinements)?;
        let Some((magnification, fields)) = placed else {
            return Ok(place.records(config.directions()));
        };
        place.magnification = magnification;
        let found = compute_through(place, &fields.map(Shape::new), config, interrupt)?;
        return Ok(found.unwrap_or_default());
    }
    let magnification = pairs.magnification(ids[0], ids[1]);
    let arrived = |records: &[PairRecord]| records.iter().filter(|r| r.arrives(config)).count();
    let mut kept: Vec<PairRecord> = Vec::new();
    for refinements in 0..=config.refinements(&pairs.grid) {
        let (start, end) = pairs.fields(ids[0], ids[1], refinements)?;
        let shapes = [start, end].map(|distance| Shape::new(distance.into_owned()));
        let place = Place {
            ids,
            magnification,
            refinements,
            through: None,
        };
        let Some(records) = compute(place, &shapes, config, interrupt)? else {
            return Ok(Vec::new());
        };
        if kept.is_empty() || arrived(&records) > arrived(&kept) {
            kept = records;
        }
        if arrived(&kept) == config.directions() {
            break;
        }
    }
    Ok(kept)
}

/// The number of finished pairs.
struct PairProgress {
    total: usize,
    /// Pairs stored by earlier runs.
    before: usize,
    done: AtomicUsize,
    begin: Instant,
}

impl PairProgress {
    fn new(total: usize, before: usize) -> Self {
        Self {
            total,
            before,
            done: AtomicUsize::new(before),
            begin: Instant::now(),
        }
    }

    fn show(&self, progress: &Progress) {
        if self.before > 0 {
            progress.note(format!(
                "going on: {} of {} pairs are there",
                self.before, self.total
            ));
        }
        progress.stage(self.words(self.before, None));
    }

    fn one_more(&self, progress: &Progress) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let rate = self.begin.elapsed().as_secs_f64() / (done - self.before) as f64;
        let left = (self.total - done) as f64 * rate;
        let words = self.words(done, Some(left));
        let every = self.total.div_ceil(NOTES);
        if done.is_multiple_of(every) || done == self.total {
            progress.milestone(&words);
        }
        progress.stage(words);
    }

    fn words(&self, done: usize, left: Option<f64>) -> String {
        let pairs = format!("{done} of {} pairs", self.total);
        match left {
            Some(left) if done < self.total => format!("{pairs}, {} left", duration(left)),
            _ => pairs,
        }
    }
}

/// A duration as text, rounded as appropriate for an estimate.
fn duration(seconds: f64) -> String {
    let seconds = Duration::try_from_secs_f64(seconds).map_or(0, |time| time.as_secs());
    match seconds {
        0..=99 => format!("{seconds} s"),
        100..=5999 => format!("{} min", (seconds + 30) / 60),
        _ => format!("{} h {} min", seconds / 3600, seconds % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_rounded() {
        let found = [0.4, 99.9, 100.0, 5999.0, 7260.0, f64::INFINITY].map(duration);
        assert_eq!(
            found,
            ["0 s", "99 s", "2 min", "100 min", "2 h 1 min", "0 s"]
        );
    }

    #[test]
    fn the_time_left_counts_this_run_only() {
        let progress_of_pairs = PairProgress::new(10, 4);
        progress_of_pairs.show(&Progress::hidden());
        for _ in 0..6 {
            progress_of_pairs.one_more(&Progress::hidden());
        }
        assert_eq!(progress_of_pairs.done.load(Ordering::Relaxed), 10);
        assert_eq!(progress_of_pairs.words(10, Some(3.0)), "10 of 10 pairs");
        assert_eq!(
            progress_of_pairs.words(5, Some(3.0)),
            "5 of 10 pairs, 3 s left"
        );
    }
}
