//! Principal modes of variation of shapes, based on elasticity.
//!
//! The elastic average `S` of shapes `S_k = boundary of O_k` comes with deformations `phi_k` of
//! `O_k` onto one object `O`. Each induces a Cauchy stress `sigma_k` in `O`; the average satisfies
//! `sum_k lambda_k sigma_k nu = 0` on `S`, and the boundary load `sigma_k nu` represents
//! displacement `u_k` (Rumpf & Wirth, *An elasticity-based covariance analysis of shapes*, IJCV
//! 2011):
//!
//! ```text
//! int C Du_k : Dw = int sigma_k : Dw  for all w,   int_O u_k = 0,   int_O x cross u_k = 0,
//! C = sum_i lambda_i (det Dphi_i)^-1 (Dphi_i W_,AA[Dphi_i] Dphi_i^T) o phi_i^-1.
//! ```
//!
//! Displacements form a vector space, so a principal component analysis is defined: `u_k` points
//! away from shape `k`, and `S_k` is approximately `(1 - u_k)(S)`.
//!
//! These displacements are linear in the stresses. [`Variation::Displacement`] takes those of the
//! deformations themselves instead, `u_k = 1 - phi_k^{-1}`: shapes whose parts turn by large angles, such as
//! fingers, need fewer of their modes.
//!
//! # Data flow
//! [`Average`] (deformations, indicators, weights) → [`Balancing`], where the stresses do not balance →
//! [`Compound`], the operator `K` assembled by
//! pull-back, without inverting deformations, under its rigid constraints → loads and
//! displacements, centred → their Gram matrix in the inner product of [`Metric`] → [`Modes`] →
//! [`Pca`], whose [`ModeSpace`] scores and reconstructs other shapes. [`Quality`] measures the
//! modes as a model: compactness, generalisation, specificity. [`Finite`] is the nonlinear variant
//! for finite loads.
//!
//! Scores are in standard deviations: with eigenvalues `Lambda_j` and orthonormal modes `y_j`, the
//! score of a displacement `u` is `g(u, y_j) / sqrt Lambda_j`, and its Mahalanobis distance is
//! `sqrt(sum_j score_j^2)` over modes of notable variance. The lecture notes divide by the number of
//! training shapes, `d_M^2 = (1/n) sum_j score_j^2`: these then have the mean square `(n-1)/n`.
//! [`Mahalanobis`] has both.
//!
//! **Invariant:** the physics is that of `hyperelastic`, pointwise; input and output are fields,
//! and no files are read or written.
//!
//! The crates whose types are in signatures are re-exported: [`fe_grid`], [`hyperelastic`],
//! [`levelset`], [`nalgebra`], [`shape_average`].
//!
//! # Features
//! - `clap`: the parameters are options of a command line (`clap::Args`).

#![forbid(unsafe_code)]

mod average;
mod compound;
mod displacements;
mod doubts;
mod equilibrium;
mod error;
mod finite;
pub mod groups;
mod krylov;
mod mahalanobis;
mod memory;
mod metric;
mod modes;
mod operator;
mod params;
mod pca;
mod product;
mod push;
mod quality;
mod random;
mod rigid;
mod sample;
mod space;
mod variation;

pub use fe_grid;
pub use hyperelastic;
pub use levelset;
pub use nalgebra;
pub use shape_average;

pub use average::Average;
pub use compound::{Source, evaluate};
pub use equilibrium::{BalanceReport, Balancing};
pub use error::PcaError;
pub use finite::{Finite, FiniteReport};
pub use krylov::SolveReport;
pub use mahalanobis::{Mahalanobis, NEGLIGIBLE_VARIANCE};
pub use memory::{memory_estimate, memory_estimate_of_response};
pub use modes::{Modes, Scores};
pub use operator::{Compound, representation};
pub use params::{Metric, PcaParams};
pub use pca::Pca;
pub use product::object_product;
pub use push::push_forward;
pub use quality::Quality;
pub use rigid::RigidMotions;
pub use sample::SampleSize;
pub use space::ModeSpace;
pub use variation::Variation;

/// The examples of the README are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
