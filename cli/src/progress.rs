//! Progress on standard error: a moving line, or plain lines where that is no terminal.

use std::io::{IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// How far a computation has come. It has one line that is overwritten, and finished stages stay
/// above it.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    /// Whether notes go to standard error as plain lines, there being no moving line.
    plain: bool,
}

impl Progress {
    /// Shows progress on standard error; only notes where that is no terminal.
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

    /// A stage begins, such as `reading` or `65 nodes a side`.
    pub fn stage(&self, name: impl Into<String>) {
        self.bar.set_prefix(name.into());
        self.bar.set_message("");
    }

    /// One iteration of a minimiser is done.
    pub fn iteration(&self, iteration: usize, evaluations: usize, energy: f64) {
        self.bar.set_message(format!(
            "iteration {iteration}, {evaluations} evaluations, energy {energy:.6e}"
        ));
        self.bar.tick();
    }

    /// Leaves a line above the moving one.
    pub fn note(&self, text: impl AsRef<str>) {
        if self.plain {
            // A closed standard error is no reason to stop.
            let _ = writeln!(std::io::stderr(), "{}", text.as_ref());
        }
        self.bar.println(text);
    }

    /// Leaves a line only where there is no moving one that says the same.
    pub fn milestone(&self, text: impl AsRef<str>) {
        if self.plain {
            self.note(text);
        }
    }

    /// Takes the moving line away.
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
