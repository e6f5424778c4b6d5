//! Form B: paths of deformations of one start domain.

mod eulerian;
mod hessian;
mod matched;
mod metric;
mod objective;
mod search;
mod solve;
mod stability;
mod starts;
mod steps;

pub(crate) use eulerian::{Eulerian, eulerian, step_between};
pub use objective::PathObjective;
pub use solve::{
    Domain, LagrangianPath, lagrangian_path, lagrangian_path_back, lagrangian_path_from,
};
pub(crate) use solve::{
    KnownPath, lagrangian_path_below, lagrangian_path_near, lagrangian_path_on, weight_on,
};
pub(crate) use stability::{OwnPath, stability};
pub(crate) use steps::Between;
