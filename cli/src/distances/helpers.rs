//! Pairs for other processes: the first has the list and the files, the others ask for one pair after the
//! other, and send its paths with the next question. A process that is fast computes more of them.
//!
//! All messages are JSON: a [`Question`] to the first process, and a pair ([`Way`]), or null
//! where there are no more, back.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use fe_grid::communicator::Communicator;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::args::DistancesConfig;
use super::compute::{paths_of, share};
use super::pair::{PairRecord, Way};
use crate::error::CliError;
use crate::pool::{in_pool, no_threads};
use crate::session::Session;
use crate::shapes::Pairs;

/// Pause before messages are looked for again. Paths take a hundred times as long.
const PAUSE: Duration = Duration::from_millis(1);

/// What a process tells the first.
#[derive(Debug, Serialize, Deserialize)]
enum Question {
    /// It asks for the next pair, and has computed these paths.
    Next(Vec<PairRecord>),
    /// All of its threads have been told that there are no more pairs.
    Done,
}

/// A pair, or no more of them.
type Answer = Option<Way>;

/// Hands out pairs to the other processes, and keeps what they have computed, until all have been told
/// that there are no more, or this process is `stopped`.
///
/// # Errors
/// Those of `keep`.
pub(super) fn lead(
    communicator: &dyn Communicator,
    hand_out: &dyn Fn() -> Answer,
    keep: &dyn Fn(&[PairRecord]) -> Result<(), CliError>,
    stopped: &dyn Fn() -> bool,
) -> Result<(), CliError> {
    let helpers = communicator.size() - 1;
    if helpers == 0 {
        return Ok(());
    }
    // Another round.
    communicator.broadcast(0, &mut [1.0]);
    let mut done = 0;
    // Where this process stops, it ends the others, too.
    while done < helpers && !stopped() {
        let Some((from, message)) = communicator.receive() else {
            std::thread::sleep(PAUSE);
            continue;
        };
        match parsed(&message)? {
            Question::Next(records) => {
                keep(&records)?;
                communicator.send(from, &text(&hand_out())?);
            }
            Question::Done => done += 1,
        }
    }
    Ok(())
}

/// Tells the other processes that there are no more rounds.
pub(super) fn dismiss(communicator: &dyn Communicator) {
    if communicator.size() > 1 {
        communicator.broadcast(0, &mut [0.0]);
    }
}

/// Computes pairs for the first process, as long as it has some.
///
/// # Errors
/// Those of the paths.
pub(super) fn help<const D: usize>(
    pairs: &Pairs<D>,
    config: &DistancesConfig,
    at_once: Option<u32>,
    session: &Session<'_>,
) -> Result<(), CliError> {
    let communicator = &*session.processes;
    let threads = rayon::current_num_threads();
    let workers = at_once.map_or(threads, |n| n as usize).clamp(1, threads);
    loop {
        let mut more = [0.0];
        communicator.broadcast(0, &mut more);
        if more[0] == 0.0 {
            return Ok(());
        }
        let (ask, questions) = channel();
        let failed = AtomicBool::new(false);
        let work = |threads: usize, ask: Sender<Asked>| {
            let done = in_pool(Some(threads as u32), || {
                let mut records = Vec::new();
                loop {
                    let (reply, answer) = channel();
                    let question = Asked { records, reply };
                    // The main thread of this process answers as long as anybody asks.
                    let answer = ask.send(question).ok().and_then(|()| answer.recv().ok());
                    let Some(way) = answer.flatten() else {
                        return Ok(());
                    };
                    records = paths_of(pairs, way, config, &session.interrupt)?;
                }
            });
            if done.is_err() {
                failed.store(true, Ordering::Relaxed);
            }
            done
        };
        std::thread::scope(|scope| {
            let started: Vec<_> = (0..workers)
                .map(|k| {
                    let share = share(threads, workers, k);
                    let (ask, work) = (ask.clone(), &work);
                    std::thread::Builder::new().spawn_scoped(scope, move || work(share, ask))
                })
                .collect();
            drop(ask);
            if started.iter().any(Result::is_err) {
                // The others hear of no more pairs.
                failed.store(true, Ordering::Relaxed);
            }
            pass_on(communicator, &questions, &failed)?;
            drop(questions);
            for worker in started {
                match worker.map_err(|error| no_threads(&error))?.join() {
                    Ok(found) => found?,
                    Err(panic) => std::panic::resume_unwind(panic),
                }
            }
            Ok::<(), CliError>(())
        })?;
        communicator.send(0, &text(&Question::Done)?);
    }
}

/// A question of a thread of this process.
struct Asked {
    records: Vec<PairRecord>,
    reply: Sender<Answer>,
}

/// Passes questions of the threads on to the first process, and its answers back in the same order, until
/// there are no more threads that could ask, or one has failed.
fn pass_on(
    communicator: &dyn Communicator,
    questions: &Receiver<Asked>,
    failed: &AtomicBool,
) -> Result<(), CliError> {
    let mut waiting = VecDeque::new();
    loop {
        if failed.load(Ordering::Relaxed) {
            return Ok(());
        }
        match questions.recv_timeout(PAUSE) {
            Ok(asked) => {
                communicator.send(0, &text(&Question::Next(asked.records))?);
                waiting.push_back(asked.reply);
            }
            Err(RecvTimeoutError::Disconnected) if waiting.is_empty() => return Ok(()),
            Err(_) => {}
        }
        while let Some((_, message)) = communicator.receive() {
            let answer: Answer = parsed(&message)?;
            if let Some(reply) = waiting.pop_front() {
                // A thread that has failed does not wait any more; its error is reported.
                let _ = reply.send(answer);
            }
        }
    }
}

fn text(message: &impl Serialize) -> Result<Vec<u8>, CliError> {
    serde_json::to_vec(message).map_err(|error| garbled(&error))
}

fn parsed<T: DeserializeOwned>(message: &[u8]) -> Result<T, CliError> {
    serde_json::from_slice(message).map_err(|error| garbled(&error))
}

fn garbled(error: &serde_json::Error) -> CliError {
    CliError::Computation {
        message: format!("processes do not understand each other: {error}"),
        remedy: "start the same program on all machines".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distances::pair::Place;
    use fe_grid::communicator::on_threads;
    use std::sync::{Arc, Mutex};

    /// Two processes with two threads each compute all of ten pairs once.
    #[test]
    fn every_pair_is_handed_out_once() {
        let kept = Mutex::new(Vec::new());
        let handed = Mutex::new((0..10).map(|i| Way::direct([i, i + 1])).collect::<Vec<_>>());
        on_threads(3, &|communicator: Arc<dyn Communicator>| {
            if communicator.rank() == 0 {
                let hand_out = || handed.lock().unwrap().pop();
                let keep = |records: &[PairRecord]| {
                    kept.lock()
                        .unwrap()
                        .extend(records.iter().map(PairRecord::pair));
                    Ok(())
                };
                lead(&*communicator, &hand_out, &keep, &|| false).unwrap();
                dismiss(&*communicator);
                return;
            }
            let mut more = [0.0];
            communicator.broadcast(0, &mut more);
            let (ask, questions) = channel();
            std::thread::scope(|scope| {
                for _ in 0..2 {
                    let ask = ask.clone();
                    scope.spawn(move || {
                        let mut records = Vec::new();
                        loop {
                            let (reply, answer) = channel();
                            ask.send(Asked { records, reply }).unwrap();
                            let Some(way) = answer.recv().unwrap() else {
                                return;
                            };
                            let place = Place {
                                ids: way.ids,
                                magnification: 1.0,
                                refinements: 0,
                                through: None,
                            };
                            records = place.records(1);
                        }
                    });
                }
                drop(ask);
                pass_on(&*communicator, &questions, &AtomicBool::new(false)).unwrap();
            });
            communicator.send(0, &text(&Question::Done).unwrap());
            communicator.broadcast(0, &mut more);
            assert_eq!(more, [0.0]);
        });
        let mut kept = kept.into_inner().unwrap();
        kept.sort_unstable();
        assert_eq!(kept, (0..10).map(|i| [i, i + 1]).collect::<Vec<_>>());
    }
}
