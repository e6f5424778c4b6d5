//! Form A: paths of level sets, each deformed into the next.

mod flow;
mod metric;
mod objective;
mod solve;
mod state;
mod transport;

pub use flow::{Flow, flow};
pub use objective::{LevelSetEnergy, LevelSetObjective};
pub(crate) use solve::on_grid;
pub use solve::{LevelSetLevel, LevelSetPath, level_set_path};
pub use state::PathState;
