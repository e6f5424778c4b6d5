//! Form A: paths of level sets, each deformed into the next.

mod first;
mod flow;
mod metric;
mod objective;
mod residual;
mod solve;
mod state;
mod transport;

pub(crate) use first::{first_paths, flow_path};
pub use objective::LevelSetObjective;
pub use solve::{LevelSetPath, level_set_path};
pub use state::PathState;
pub(crate) use state::compose;
