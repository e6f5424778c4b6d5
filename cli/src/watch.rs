//! Progress of a minimisation.

use std::time::{Duration, Instant};

use fe_grid::minimise::{Control, Iteration, Observer};

use crate::history::HistoryPoint;
use crate::interrupt::Interrupt;
use crate::progress::Progress;

/// The size of a grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GridSize {
    /// Nodes along its longest side.
    pub side: usize,
    /// All nodes.
    pub nodes: usize,
}

/// An observer that shows every iteration, records the convergence history, and cancels on request.
pub(crate) struct ProgressObserver<'a> {
    progress: &'a Progress,
    interrupt: Interrupt,
    /// Every grid, coarsest first.
    grids: Vec<GridSize>,
    /// Names of a level and of its energy.
    words: [&'static str; 2],
    history: Vec<HistoryPoint>,
    level: usize,
    n_levels: usize,
    /// The number of unknowns of the level.
    unknowns: usize,
    /// Evaluations on earlier levels.
    before: usize,
    begin: Instant,
    /// Iterations of the level before.
    expected: Option<usize>,
}

/// Levels that take less time end before an estimate of it has been read.
const LONG: Duration = Duration::from_secs(10);

impl<'a> ProgressObserver<'a> {
    pub fn new(progress: &'a Progress, interrupt: Interrupt, grids: Vec<GridSize>) -> Self {
        Self {
            progress,
            interrupt,
            history: Vec::new(),
            level: 0,
            n_levels: grids.len(),
            unknowns: 0,
            grids,
            words: ["level", "energy"],
            before: 0,
            begin: Instant::now(),
            expected: None,
        }
    }

    /// Observes the solution of equations: each equation is a level, and the remaining correction
    /// its energy.
    pub fn of_equations(self) -> Self {
        Self {
            words: ["equation", "correction"],
            ..self
        }
    }

    /// The convergence history; prints the line of the last level.
    pub fn finish(self) -> Vec<HistoryPoint> {
        self.level_done();
        self.history
    }

    /// The convergence history so far.
    pub fn history(&self) -> &[HistoryPoint] {
        &self.history
    }

    /// Takes over the convergence history of this level from a run that it resumes.
    pub fn restore(&mut self, history: Vec<HistoryPoint>) {
        self.history.extend(history);
    }

    /// Prints a note.
    pub fn note(&self, text: String) {
        self.progress.note(text);
    }

    /// Nodes a side of this level: of the finest grid of which it has so many unknowns a node. Where that is none, and
    /// there are more levels than grids, the first of them are on the coarsest; where there are fewer, the coarsest are
    /// left out.
    pub fn nodes(&self) -> usize {
        let fits = |grid: &&GridSize| self.unknowns > 0 && self.unknowns.is_multiple_of(grid.nodes);
        if let Some(grid) = self.grids.iter().rev().find(fits) {
            return grid.side;
        }
        let finer = self.n_levels.saturating_sub(self.level + 1);
        let position = self.grids.len().saturating_sub(finer + 1);
        self.grids.get(position).map_or(0, |grid| grid.side)
    }

    fn title(&self) -> String {
        format!(
            "{} {} of {}, {} nodes a side",
            self.words[0],
            self.level + 1,
            self.n_levels,
            self.nodes()
        )
    }

    fn level_done(&self) {
        let Some(last) = self.history.last() else {
            return;
        };
        self.progress.note(format!(
            "{}: {} iterations, {} {:.6e}, {:.1} s",
            self.title(),
            last.iteration,
            self.words[1],
            last.energy,
            self.begin.elapsed().as_secs_f64()
        ));
    }
}

impl Observer for ProgressObserver<'_> {
    fn level(&mut self, level: usize, n_levels: usize, dim: usize) {
        if level > 0 {
            self.level_done();
        }
        (self.level, self.n_levels, self.unknowns) = (level, n_levels, dim);
        self.before = self.history.last().map_or(0, |point| point.evaluations);
        self.expected = self.history.last().map(|point| point.iteration);
        self.begin = Instant::now();
        self.progress.stage(self.title());
    }

    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        let evaluations = self.before + iteration.evaluations.energies();
        self.history.push(HistoryPoint {
            level: self.level,
            nodes: self.nodes(),
            iteration: iteration.iteration,
            evaluations,
            energy: iteration.energy,
        });
        let left = self
            .expected
            .and_then(|expected| time_left(expected, iteration.iteration, self.begin.elapsed()));
        self.progress
            .iteration(iteration.iteration, evaluations, iteration.energy, left);
        self.between()
    }

    fn between(&mut self) -> Control {
        self.interrupt.between()
    }
}

/// The time that a level takes still, if it takes as many iterations as expected; none of a level that is
/// short, or takes more.
fn time_left(expected: usize, iteration: usize, elapsed: Duration) -> Option<Duration> {
    let more = expected.checked_sub(iteration).filter(|more| *more > 0)?;
    let left = elapsed.checked_div(iteration.try_into().ok()?)? * u32::try_from(more).ok()?;
    (elapsed + left > LONG).then_some(left)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_left_while_fewer_iterations_are_done_than_expected() {
        let seconds = Duration::from_secs;
        assert_eq!(time_left(20, 5, seconds(10)), Some(seconds(30)));
        assert_eq!(time_left(20, 20, seconds(60)), None);
        assert_eq!(time_left(20, 21, seconds(60)), None);
        assert_eq!(time_left(20, 0, seconds(60)), None);
        assert_eq!(time_left(20, 10, seconds(4)), None);
    }
    use fe_grid::minimise::Evaluations;

    #[test]
    fn evaluations_add_up_over_the_levels() {
        let progress = Progress::hidden();
        let grids = [9, 17].map(|side| GridSize {
            side,
            nodes: side * side,
        });
        let mut watch = ProgressObserver::new(&progress, Interrupt::new(), grids.into());
        let mut step = |level: Option<usize>, iteration, gradients| {
            if let Some(level) = level {
                // Both levels of a path may be on one grid, beside others.
                watch.level(level, 8, [8 * 81, 16 * 289][level]);
            }
            watch.iteration(&Iteration {
                iteration,
                energy: 1.0,
                gradient_norm: 1.0,
                step_length: 1.0,
                evaluations: Evaluations {
                    gradients,
                    ..Evaluations::default()
                },
                x: &[],
            })
        };
        assert_eq!(step(Some(0), 0, 1), Control::Continue);
        step(None, 1, 3);
        step(Some(1), 0, 1);
        step(None, 1, 2);
        let history = watch.finish();
        let found: Vec<_> = history.iter().map(|c| (c.nodes, c.evaluations)).collect();
        assert_eq!(found, [(9, 1), (9, 3), (17, 4), (17, 5)]);
    }
}
