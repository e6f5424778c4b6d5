//! Minimisers over an [`Objective`], and a driver that runs them from coarse levels to fine.
//!
//! An objective brings its own inverse metric, the best cheap guess at its inverse Hessian; a
//! state where it has no finite value (a folded deformation) is an ordinary outcome that shortens
//! the step. Every accepted step lowers the energy. The parameters of a method are the method:
//!
//! ```
//! use fe_grid::GridError;
//! use fe_grid::minimise::{Evaluation, LbfgsParams, Minimiser, Objective, Silent};
//!
//! struct Bowl;
//! impl Objective for Bowl {
//!     type Error = GridError;
//!     fn dim(&self) -> usize {
//!         2
//!     }
//!     fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, GridError> {
//!         g[0] = 2.0 * (x[0] - 1.0);
//!         g[1] = 20.0 * x[1];
//!         Ok(Evaluation::Value((x[0] - 1.0).powi(2) + 10.0 * x[1] * x[1]))
//!     }
//! }
//!
//! let mut x = [3.0, 1.0];
//! let info = LbfgsParams::default().minimise(&mut Bowl, &mut x, &mut Silent)?;
//! assert!(info.status.converged());
//! assert!((x[0] - 1.0).abs() < 1e-4 && x[1].abs() < 1e-4);
//! # Ok::<(), GridError>(())
//! ```

mod counted;
mod curvature;
mod descent;
mod differences;
mod history;
mod info;
mod lbfgs;
mod least_eigenvalue;
mod line_search;
mod memory;
mod monitor;
mod multilevel;
mod newton_cg;
mod objective;
mod observer;
mod pair_vector;
mod together;

pub use curvature::Curvature;
pub use descent::DescentParams;
pub use differences::{compare_with_differences, gradient_errors, hessian_errors};
pub use info::{Evaluations, Info, Status};
pub use lbfgs::LbfgsParams;
pub use least_eigenvalue::{LeastEigenvalue, LeastEigenvalueParams};
pub use line_search::LineSearch;
pub use memory::{Ended, Memory, MemoryPair, MemoryVector};
pub use monitor::Stopping;
pub use multilevel::{LevelInfo, LevelProblem, Multilevel, minimise_levels};
pub use newton_cg::{Comparison, NewtonCgParams};
pub use objective::{Evaluation, Minimiser, Objective, SecondOrder};
pub use observer::{Control, Iteration, Observer, Silent};
pub use together::together;
