//! Signals that ask the program to end: Ctrl-C (SIGINT), SIGTERM and SIGHUP.

use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, LazyLock};

use fe_grid::minimise::{Control, Iteration, Observer};

use crate::error::Exit;
use crate::output::discard_all;
use shapespace_input::terminal::note;

/// Nothing has been computed that could be written: a signal ends the program.
const STARTING: u8 = 0;
/// The computation listens: a signal asks it to end, and what it has reached is written.
const RUNNING: u8 = 1;
/// A signal has come: the next one ends the program.
const ASKED: u8 = 2;
/// Results are being written: a signal is answered with a note.
const WRITING: u8 = 3;
/// A signal has come while results are being written: the next one ends the program.
const WARNED: u8 = 4;

/// The state of the program: a process has a single set of handlers. Calls from another program have
/// a state each.
static STATE: LazyLock<Arc<AtomicU8>> = LazyLock::new(Arc::default);

/// Requests to stop. Before a computation has begun, a signal ends the program; the first one after
/// that ends the minimisation, and the current state is written; the next one ends the program.
#[derive(Clone, Debug)]
pub(crate) struct Interrupt(Arc<AtomicU8>);

impl Interrupt {
    /// The state of this process.
    pub fn new() -> Self {
        Self(Arc::clone(&STATE))
    }

    /// The state of one call, which no signal changes.
    pub fn of_call() -> Self {
        Self(Arc::default())
    }

    /// Asks the computation to end.
    pub fn ask(&self) {
        self.0.store(ASKED, Ordering::SeqCst);
    }

    /// Whether a signal has come. From the first call on, the computation is expected to ask again
    /// and again.
    pub fn asked(&self) -> bool {
        exchange(&self.0, STARTING, RUNNING);
        self.0.load(Ordering::SeqCst) == ASKED
    }

    /// The results are being written.
    pub fn writing(&self) {
        if !exchange(&self.0, ASKED, WARNED) {
            self.0.store(WRITING, Ordering::SeqCst);
        }
    }
}

/// An observer that only cancels on request.
impl Observer for Interrupt {
    fn iteration(&mut self, _iteration: &Iteration<'_>) -> Control {
        self.between()
    }

    fn between(&mut self) -> Control {
        if self.asked() {
            Control::Cancel
        } else {
            Control::Continue
        }
    }
}

fn exchange(state: &AtomicU8, from: u8, to: u8) -> bool {
    let exchanged = state.compare_exchange(from, to, Ordering::SeqCst, Ordering::SeqCst);
    exchanged.is_ok()
}

/// What follows from a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Answer {
    End,
    Note(&'static str),
}

fn answer(state: &AtomicU8) -> Answer {
    if exchange(state, RUNNING, ASKED) {
        Answer::Note(
            "interrupted: ends after the present iteration, and what it has reached is written; once more \
             to end at once",
        )
    } else if exchange(state, WRITING, WARNED) {
        Answer::Note("the results are being written; the next signal discards them")
    } else {
        Answer::End
    }
}

/// Answers a signal; runs on a thread of its own.
fn signalled() {
    match answer(&STATE) {
        Answer::Note(text) => note(text),
        Answer::End => {
            discard_all();
            note("interrupted: no result has been written");
            std::process::exit(i32::from(Exit::Interrupted as u8));
        }
    }
}

/// Listens to the signals. If the system does not allow it, they end the program as usual.
///
/// A write beyond the limit of file sizes (SIGXFSZ) becomes an error of that write.
#[cfg(unix)]
pub fn listen() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    let unused = std::sync::Arc::default();
    let _ = signal_hook::flag::register(SIGXFSZ, unused);
    let mut signals = vec![SIGINT, SIGTERM];
    // `nohup` starts programs with this signal ignored.
    if !ignored(SIGHUP) {
        signals.push(SIGHUP);
    }
    // The thread first, and then the handlers: where there is no thread, nobody would hear.
    let (listens, begun) = std::sync::mpsc::channel();
    let listener = move || {
        let found = signal_hook::iterator::Signals::new(signals);
        let _ = listens.send(());
        if let Ok(mut signals) = found {
            signals.forever().for_each(|_| signalled());
        }
    };
    if std::thread::Builder::new().spawn(listener).is_ok() {
        let _ = begun.recv();
    }
}

/// Listens to Ctrl-C. If the system does not allow it, that ends the program as usual.
#[cfg(not(unix))]
pub fn listen() {
    let _ = ctrlc::set_handler(signalled);
}

/// Whether a signal is ignored, where the system shows it (Linux); taken as true elsewhere.
#[cfg(unix)]
fn ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask >> (signal - 1) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_state_has_its_answer() {
        let interrupt = Interrupt::of_call();
        let state = &interrupt.0;
        assert_eq!(answer(state), Answer::End);
        assert!(!interrupt.asked());
        assert!(matches!(answer(state), Answer::Note(_)));
        assert!(interrupt.asked());
        assert_eq!(answer(state), Answer::End);
        interrupt.writing();
        assert_eq!(answer(state), Answer::End);
        state.store(RUNNING, Ordering::SeqCst);
        interrupt.writing();
        assert!(matches!(answer(state), Answer::Note(_)));
        assert!(!interrupt.asked());
        assert_eq!(answer(state), Answer::End);
    }
}
