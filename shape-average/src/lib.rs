//! The elastic average of 2D and 3D shapes.
//!
//! Shapes `S_i`, boundaries of objects `O_i`, are deformed elastically to one common shape, the
//! average, such that the sum of the stored elastic energies is minimal. With phase fields `v_i` of
//! the shapes and `v` of the average, and `phi_i = id + u_i`,
//!
//! ```text
//! E[v, (phi_i)] = sum_i lambda_i int kappa_i W(D phi_i)
//!               + (gamma/n) sum_i (1/epsilon) int (v o phi_i)^2 (1-v_i)^2 + v_i^2 (1-v o phi_i)^2
//!               + mu_L int epsilon |grad v|^2 + (v-1)^2/(4 epsilon)
//! ```
//!
//! (Rumpf & Wirth, *A nonlinear elastic shape averaging approach*, SIAM J. Imaging Sci. 2009).
//! [`average`] minimises it from coarse grids to fine, with `epsilon` proportional to the spacing;
//! [`Solver`] selects one of the two algorithms. The minimiser adds a barrier that is zero unless a
//! corner of a cell is close to folding ([`Energy::barrier`]). [`align`] aligns shapes rigidly
//! beforehand; [`match_to`] deforms a new shape onto an average, [`average_of_visible`] averages
//! partially visible shapes, and [`average_from`] continues from known deformations.
//! [`average_of_components`] averages shapes of several components: one deformation of a shape moves all
//! of them, each onto its own component of the average. [`Minima`] collects what
//! minimisations from several [`starts`] end in.
//!
//! **Invariant:** the input is signed distances on a grid, the output is fields; no files are read
//! or written except the temporary ones requested by [`AverageParams::storage`].
//!
//! ```
//! use fe_grid::minimise::Silent;
//! use fe_grid::{Grid, ScalarField};
//! use shape_average::{AverageParams, average};
//!
//! // A disk and an ellipse of one and a half times its width.
//! let grid = Grid::<2>::dyadic(5);
//! let ellipse = |a: f64| {
//!     let inside = ScalarField::from_fn(grid, |[x, y]| {
//!         [1.0 - ((x - 0.5) / a).hypot((y - 0.5) / 0.2)]
//!     });
//!     levelset::signed_distance(&inside, 0.0)
//! };
//! let result = average(&[ellipse(0.2)?, ellipse(0.3)?], &AverageParams::default(), &mut Silent)?;
//! assert!(result.certificate.certified);
//! assert!(result.mean_dice() > 0.95);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The crates whose types are in signatures are re-exported: [`fe_grid`], [`hyperelastic`],
//! [`levelset`], [`nalgebra`], [`phasefield`].
//!
//! # Features
//! - `clap`: the parameters are options of a command line (`clap::Args`).

#![forbid(unsafe_code)]

pub mod align;
mod alternating;
mod collect;
mod common;
mod confirm;
mod doubts;
mod elastic;
mod energy;
mod equations;
mod error;
mod floor;
mod follow;
mod hessian;
mod hierarchy;
pub mod joint;
mod level;
mod median;
mod memory;
mod metric;
mod minima;
mod objective;
mod params;
mod partial;
mod pushed;
mod quiet;
mod reached;
mod rematch;
mod result;
mod rounds;
mod second;
mod shapes;
mod solve;
mod strain;
mod stress;
mod turned;

pub use fe_grid;
pub use hyperelastic;
pub use levelset;
pub use nalgebra;
pub use phasefield;

pub use alternating::Alternating;
pub use elastic::elastic_energy;
pub use energy::{ComponentEnergy, Energy};
pub use error::AverageError;
pub use floor::mismatch_energy;
pub use level::LevelShapes;
pub use memory::{MemoryEstimate, memory_estimate};
pub use minima::{Minima, Minimum, Start, StartKind, doubts as doubts_of_minima, starts};
pub use objective::AverageObjective;
pub use params::{AverageParams, BoundaryCondition, Mean, Precision, Solver};
pub use pushed::LEAST_VOTE;
pub use result::{AverageResult, ComponentResult, LevelReport, Rematch, Turned};
pub use shapes::Shapes;
pub use solve::{
    average, average_distributed, average_from, average_of_components, average_of_visible,
    average_on_levels, match_components_to, match_to,
};
pub use strain::{StrainMaps, StrainRange, StrainRanges, cells_inside};
pub use stress::cauchy_stress_at_nodes;

/// The examples of the README are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
