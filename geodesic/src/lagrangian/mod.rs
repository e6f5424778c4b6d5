//! Form B: paths of deformations of one start domain.

mod metric;
mod objective;
mod solve;

pub use objective::{PathEnergy, PathObjective};
pub use solve::{LagrangianPath, PathLevel, lagrangian_path};
