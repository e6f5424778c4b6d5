//! The metric of shape space at one shape: the least dissipation of a motion of its boundary.
//!
//! A normal variation of a shape `O` is the normal velocity `v_n` of its boundary, positive
//! outwards. Its squared length in the metric is the least rate at which a viscous fluid that fills
//! `O` dissipates energy while its boundary moves so,
//!
//! ```text
//! G(v_n, v_n) = min { int_O lambda/2 (tr e[v])^2 + mu tr(e[v]^2) dx : v . n = v_n on the boundary },
//! ```
//!
//! and the minimiser `v` is the optimal velocity. The fluid slips along its boundary, and there is
//! none outside. Rigid motions cost nothing.
//!
//! **Discretisation.** Velocities are multilinear on the grid of the signed distance; cells that
//! the boundary cuts are integrated over their occupied part. The
//! condition at the boundary holds at quadrature points on the contour, where the normal is that
//! of the smoothed distance ([`BoundaryPoints`]). An augmented Lagrangian imposes it: its penalty acts
//! at all points, its multipliers are constant on patches of two cells a side, few enough for a
//! stable pair. The linear systems are those of the paths, with the same conjugate gradients and
//! multigrid cycle. Cells of the void have a small stiffness, which determines the velocity there; its
//! share of the energy is part of the result, and not of `G`. For smooth boundaries the error of `G`
//! has order two in the spacing.
//!
//! Source: the lecture notes of Rumpf and Wirth, section 6; Wirth, Bar, Rumpf and Sapiro, *A Continuum
//! Mechanical Approach to Geodesics in Shape Space* (2011).
//!
//! ```
//! use fe_grid::minimise::Silent;
//! use fe_grid::{Grid, ScalarField};
//! use geodesic::boundary_metric::{MetricParams, ShapeMetric, Variation};
//!
//! let disk = ScalarField::<f64, 2>::from_fn(Grid::dyadic(5), |[x, y]| {
//!     [0.3 - (x - 0.5).hypot(y - 0.5)]
//! });
//! let metric = ShapeMetric::new(&disk, &MetricParams::default())?;
//! let flow = metric.flow(&Variation::Growth, &mut Silent)?;
//! // A disk that grows: 2 pi (lambda + mu), of any radius.
//! assert!((flow.metric() / (4.0 * std::f64::consts::PI) - 1.0).abs() < 0.01);
//! # Ok::<(), geodesic::GeodesicError>(())
//! ```

mod boundary;
mod cut;
mod doubts;
mod elements;
mod energy;
mod estimate;
mod memory;
mod operator;
mod params;
mod shape;
mod solve;
mod variation;

pub use boundary::{BoundaryPoint, BoundaryPoints};
pub use estimate::{Estimate, estimate, estimate_of_mask};
pub use memory::memory_estimate;
pub use params::MetricParams;
pub use solve::{Flow, ShapeMetric};
pub use variation::Variation;
