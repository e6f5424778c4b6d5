//! Progress on standard error, a line that is overwritten, or plain lines if it is no terminal; or
//! events for a calling program.

use std::io::IsTerminal;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use shapespace_input::terminal::{note, printable};

/// What a calling program hears of a computation.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// A stage has begun, such as `level 2 of 5, 65 nodes a side`.
    Stage(String),
    /// An iteration of a minimiser.
    Iteration {
        /// Its number on this level.
        iteration: usize,
        /// Evaluations of the energy so far.
        evaluations: usize,
        /// The energy.
        energy: f64,
    },
    /// A note, such as the work of a finished level, or a warning.
    Note(String),
}

/// Receives events, on the thread of the computation.
pub type Listener = Arc<dyn Fn(Event) + Send + Sync>;

/// Progress of a computation: one line that is overwritten; finished stages stay above it.
pub struct Progress {
    bar: ProgressBar,
    listener: Option<Listener>,
    /// Whether notes are printed as plain lines on standard error, without an overwritten line.
    plain: bool,
    /// When the last plain line was printed.
    last: Arc<Mutex<Instant>>,
    /// Ends the thread that prints a plain line where there has been none for long.
    silence: Mutex<Option<Sender<()>>>,
}

/// Longest time without a plain line.
const SILENCE: Duration = Duration::from_secs(10);

impl Progress {
    /// Shows progress on standard error; only notes if it is no terminal.
    pub fn stderr() -> Self {
        if std::io::stderr().is_terminal() {
            Self::on(ProgressDrawTarget::stderr(), false)
        } else {
            Self::on(ProgressDrawTarget::hidden(), true)
        }
    }

    /// Shows nothing.
    pub fn hidden() -> Self {
        Self::on(ProgressDrawTarget::hidden(), false)
    }

    /// Shows nothing, and tells a calling program.
    pub fn told(listener: Option<Listener>) -> Self {
        Self {
            bar: ProgressBar::hidden(),
            listener,
            plain: false,
            last: Arc::new(Mutex::new(Instant::now())),
            silence: Mutex::new(None),
        }
    }

    fn tell(&self, event: impl FnOnce() -> Event) {
        if let Some(listener) = &self.listener {
            listener(event());
        }
    }

    fn on(target: ProgressDrawTarget, plain: bool) -> Self {
        let bar = ProgressBar::with_draw_target(None, target);
        // The template is a constant that parses; the plain style is as good where it does not.
        if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix}  {msg}  {elapsed}") {
            bar.set_style(style);
        }
        // The bar panics where its thread cannot be started.
        let probe = || {
            thread::Builder::new()
                .spawn(|| ())
                .map(thread::JoinHandle::join)
        };
        let can_start = || matches!(probe(), Ok(Ok(())));
        if !bar.is_hidden() && can_start() {
            bar.enable_steady_tick(Duration::from_millis(120));
        }
        let last = Arc::new(Mutex::new(Instant::now()));
        let silence = plain.then(|| break_silence(bar.clone(), Arc::clone(&last)));
        Self {
            bar,
            listener: None,
            plain,
            last,
            silence: Mutex::new(silence.flatten()),
        }
    }

    /// Starts a stage, such as `reading` or `65 nodes a side`.
    pub fn stage(&self, name: impl Into<String>) {
        let name = name.into();
        self.tell(|| Event::Stage(name.clone()));
        self.bar.set_prefix(printable(&name));
        self.bar.set_message("");
    }

    /// Shows an iteration of a minimiser, and about how much time is left on this level.
    pub fn iteration(
        &self,
        iteration: usize,
        evaluations: usize,
        energy: f64,
        left: Option<Duration>,
    ) {
        self.tell(|| Event::Iteration {
            iteration,
            evaluations,
            energy,
        });
        let left = left.map_or_else(String::new, |left| {
            format!(", about {} s left on this level", left.as_secs().max(1))
        });
        let text =
            format!("iteration {iteration}, {evaluations} evaluations, energy {energy:.6e}{left}");
        self.bar.set_message(text);
        self.bar.tick();
    }

    /// Prints a line above the overwritten one.
    pub fn note(&self, text: impl AsRef<str>) {
        let text = printable(text.as_ref());
        self.tell(|| Event::Note(text.clone()));
        if self.plain {
            note(&text);
            if let Ok(mut last) = self.last.lock() {
                *last = Instant::now();
            }
        }
        self.bar.println(text);
    }

    /// Prints a line unless the overwritten one says the same.
    pub fn milestone(&self, text: impl AsRef<str>) {
        if self.plain {
            self.note(text);
        }
    }

    /// Removes the overwritten line.
    pub fn finish(&self) {
        // A panic elsewhere ends the program.
        if let Ok(mut silence) = self.silence.lock() {
            silence.take();
        }
        self.bar.finish_and_clear();
    }
}

/// Starts a thread that prints what is being done where no line has been printed for long, until the sender
/// is dropped. Where it cannot be started there is silence.
fn break_silence(bar: ProgressBar, last: Arc<Mutex<Instant>>) -> Option<Sender<()>> {
    let (sender, receiver) = channel();
    let (begins, begun) = channel();
    let print = move || {
        let _ = begins.send(());
        after_silence(&receiver, &last, SILENCE, &|| note(doing(&bar)));
    };
    let name = "progress".to_owned();
    let started = thread::Builder::new().name(name).spawn(print);
    // It has begun before the computation takes memory (see `pool`).
    started.ok().and(begun.recv().ok()).map(|()| sender)
}

/// The stage and its last iteration, with the time since the beginning.
fn doing(bar: &ProgressBar) -> String {
    let (stage, iteration) = (bar.prefix(), bar.message());
    let parts = [stage.as_str(), iteration.as_str()].into_iter();
    let mut parts: Vec<String> = parts.filter(|p| !p.is_empty()).map(Into::into).collect();
    parts.push(format!("{} s since the start", bar.elapsed().as_secs()));
    parts.join(", ")
}

/// Calls `print` whenever so much time has passed since the last line, until the sender is dropped.
fn after_silence(
    receiver: &Receiver<()>,
    last: &Mutex<Instant>,
    longest: Duration,
    print: &dyn Fn(),
) {
    // A panic elsewhere ends the program.
    let passed = || last.lock().map_or(Duration::ZERO, |last| last.elapsed());
    loop {
        let wait = longest.saturating_sub(passed());
        match receiver.recv_timeout(wait) {
            Err(RecvTimeoutError::Timeout) if passed() >= longest => {
                print();
                if let Ok(mut last) = last.lock() {
                    *last = Instant::now();
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Ok(()) | Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

impl std::fmt::Debug for Progress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let told = self.listener.is_some();
        f.debug_struct("Progress")
            .field("bar", &self.bar)
            .field("told", &told)
            .field("plain", &self.plain)
            .finish_non_exhaustive()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_progress_takes_every_call() {
        let progress = Progress::hidden();
        progress.stage("65 nodes a side");
        progress.iteration(3, 5, 0.25, None);
        progress.note("done");
        assert!(progress.bar.is_hidden());
        assert_eq!(progress.bar.prefix(), "65 nodes a side");
        progress.finish();
        assert!(progress.bar.is_finished());
    }

    /// A line printed meanwhile puts the next one off; none follows the end.
    #[test]
    fn silence_is_broken_until_the_end() {
        let (sender, receiver) = channel();
        let last = Arc::new(Mutex::new(Instant::now()));
        let longest = Duration::from_millis(20);
        let printed = Arc::new(Mutex::new(Vec::new()));
        let thread = {
            let (last, printed) = (Arc::clone(&last), Arc::clone(&printed));
            thread::spawn(move || {
                let print = || printed.lock().unwrap().push(last.lock().unwrap().elapsed());
                after_silence(&receiver, &last, longest, &print);
            })
        };
        while printed.lock().unwrap().len() < 3 {
            thread::yield_now();
        }
        drop(sender);
        thread.join().unwrap();
        let waits = printed.lock().unwrap().clone();
        assert!(waits.iter().all(|wait| *wait >= longest), "{waits:?}");
    }

    #[test]
    fn what_is_done_is_the_stage_with_its_iteration() {
        let progress = Progress::hidden();
        progress.stage("solving");
        assert!(doing(&progress.bar).starts_with("solving, "));
        progress.iteration(3, 5, 0.25, Some(Duration::from_secs(70)));
        let expected = "solving, iteration 3, 5 evaluations, energy 2.500000e-1, \
            about 70 s left on this level, ";
        assert!(doing(&progress.bar).starts_with(expected));
    }

    #[test]
    fn a_calling_program_hears_every_event_in_order() {
        let heard = Arc::new(std::sync::Mutex::new(Vec::new()));
        let into = Arc::clone(&heard);
        let progress = Progress::told(Some(Arc::new(move |event| {
            into.lock().unwrap().push(event);
        })));
        progress.stage("reading");
        progress.iteration(3, 5, 0.25, None);
        progress.note("done");
        let iteration = Event::Iteration {
            iteration: 3,
            evaluations: 5,
            energy: 0.25,
        };
        let expected = [
            Event::Stage("reading".into()),
            iteration,
            Event::Note("done".into()),
        ];
        assert_eq!(*heard.lock().unwrap(), expected);
    }
}
