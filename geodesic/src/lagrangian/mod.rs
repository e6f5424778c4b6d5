//! Form B: paths of deformations of one start domain.

mod eulerian;
mod metric;
mod objective;
mod solve;

pub(crate) use eulerian::{Eulerian, eulerian, step_between};
pub use objective::PathObjective;
pub use solve::{
    Domain, LagrangianPath, lagrangian_path, lagrangian_path_back, lagrangian_path_from,
};
