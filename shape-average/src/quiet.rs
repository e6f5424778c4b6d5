//! An observer that ignores all reports but can cancel.

use fe_grid::minimise::{Control, Iteration, Observer};

/// Passes on a request to cancel, and nothing else: the steps of a subproblem are not reported as
/// those of the whole problem.
pub(crate) struct Quiet<'a>(pub &'a mut dyn Observer);

impl Observer for Quiet<'_> {
    fn iteration(&mut self, _iteration: &Iteration<'_>) -> Control {
        self.0.between()
    }

    fn between(&mut self) -> Control {
        self.0.between()
    }
}
