//! Progress on standard error, hidden where that is no terminal.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// How far a computation has come. It has one line that is overwritten, and finished stages stay
/// above it.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Shows progress where standard error is a terminal.
    pub fn stderr() -> Self {
        if std::io::stderr().is_terminal() {
            Self::on(ProgressDrawTarget::stderr())
        } else {
            Self::hidden()
        }
    }

    /// Shows nothing.
    pub fn hidden() -> Self {
        Self::on(ProgressDrawTarget::hidden())
    }

    fn on(target: ProgressDrawTarget) -> Self {
        let bar = ProgressBar::with_draw_target(None, target);
        // The template is a constant that parses; the plain style is as good where it does not.
        if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix}  {msg}  {elapsed}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(120));
        Self { bar }
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
        self.bar.println(text);
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
