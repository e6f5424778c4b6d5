//! Form A: paths of level sets, each deformed into the next.

mod metric;
mod objective;
mod solve;
mod transport;

pub use objective::{LevelSetEnergy, LevelSetObjective};
pub use solve::{LevelSetLevel, LevelSetPath, PathState, level_set_path};
