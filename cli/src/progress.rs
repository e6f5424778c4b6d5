//! Progress on standard error: a line that is overwritten, or plain lines if it is no terminal.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::print::{note, printable};

/// Progress of a computation: one line that is overwritten; finished stages stay above it.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    /// Whether notes are printed as plain lines on standard error, without an overwritten line.
    plain: bool,
}

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

    fn on(target: ProgressDrawTarget, plain: bool) -> Self {
        let bar = ProgressBar::with_draw_target(None, target);
        // The template is a constant that parses; the plain style is as good where it does not.
        if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix}  {msg}  {elapsed}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(120));
        Self { bar, plain }
    }

    /// Starts a stage, such as `reading` or `65 nodes a side`.
    pub fn stage(&self, name: impl Into<String>) {
        self.bar.set_prefix(printable(&name.into()));
        self.bar.set_message("");
    }

    /// Shows an iteration of a minimiser.
    pub fn iteration(&self, iteration: usize, evaluations: usize, energy: f64) {
        self.bar.set_message(format!(
            "iteration {iteration}, {evaluations} evaluations, energy {energy:.6e}"
        ));
        self.bar.tick();
    }

    /// Prints a line above the overwritten one.
    pub fn note(&self, text: impl AsRef<str>) {
        let text = printable(text.as_ref());
        if self.plain {
            note(&text);
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
        self.bar.finish_and_clear();
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
        progress.iteration(3, 5, 0.25);
        progress.note("done");
        assert!(progress.bar.is_hidden());
        assert_eq!(progress.bar.prefix(), "65 nodes a side");
        progress.finish();
        assert!(progress.bar.is_finished());
    }
}
