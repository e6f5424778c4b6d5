//! An observer that hears of nothing but may stop everything.

use fe_grid::minimise::{Control, Iteration, Observer};

/// Passes on the wish to stop, and nothing else: the steps of a part are not those of the whole.
pub(crate) struct Quiet<'a>(pub &'a mut dyn Observer);

impl Observer for Quiet<'_> {
    fn iteration(&mut self, _iteration: &Iteration<'_>) -> Control {
        self.0.between()
    }

    fn between(&mut self) -> Control {
        self.0.between()
    }
}
