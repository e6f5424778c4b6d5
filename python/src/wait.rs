//! Waits for a computation on a thread of its own: Python hears signals and reports of progress in
//! the meantime.

use std::collections::VecDeque;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use shapespace::api::{Event, Listener};

/// Time between two looks at signals.
const PATIENCE: Duration = Duration::from_millis(50);

/// Events that Python has not heard of yet.
#[derive(Clone, Default)]
pub struct Heard(Arc<Mutex<VecDeque<Event>>>);

impl Heard {
    /// Keeps events until Python asks for them. Of iterations one after the other, the last.
    pub fn listener(&self) -> Listener {
        let heard = Arc::clone(&self.0);
        Arc::new(move |event| {
            let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
            let repeated = matches!(event, Event::Iteration { .. })
                && matches!(heard.back(), Some(Event::Iteration { .. }));
            if repeated {
                heard.pop_back();
            }
            heard.push_back(event);
        })
    }

    /// Calls a function of Python for every event.
    fn tell(&self, py: Python<'_>, callback: &Bound<'_, PyAny>) -> PyResult<()> {
        let events = std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        if events.is_empty() {
            return Ok(());
        }
        let module = py.import("shapespace._progress")?;
        for event in events {
            let event = match event {
                Event::Stage(name) => module.getattr("Stage")?.call1((name,))?,
                Event::Note(text) => module.getattr("Note")?.call1((text,))?,
                Event::Iteration {
                    iteration,
                    evaluations,
                    energy,
                } => module
                    .getattr("Iteration")?
                    .call1((iteration, evaluations, energy))?,
                _ => continue,
            };
            callback.call1((event,))?;
        }
        Ok(())
    }
}

/// Runs work on another thread, without the lock of the interpreter. Ctrl-C, or an exception of the
/// callback, ends the wait at once and calls `stop`; the work then ends at its next step.
///
/// # Errors
/// The exception of a signal or of the callback; `RuntimeError` where the work has panicked.
pub fn wait<T: Send + 'static>(
    py: Python<'_>,
    heard: &Heard,
    callback: Option<&Bound<'_, PyAny>>,
    stop: impl Fn(),
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        // Nobody waits after an interruption.
        let _ = sender.send(work());
    });
    let receiver = Mutex::new(receiver);
    loop {
        let found = py.detach(|| {
            let receiver = receiver.lock().unwrap_or_else(PoisonError::into_inner);
            receiver.recv_timeout(PATIENCE)
        });
        let told = callback.map_or(Ok(()), |callback| heard.tell(py, callback));
        told.and_then(|()| py.check_signals())
            .inspect_err(|_| stop())?;
        match found {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err(
                    "the computation ended by an error of the program; please report it with the \
                     inputs",
                ));
            }
        }
    }
}
