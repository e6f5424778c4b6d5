//! Geodesics in a space of 2D and 3D shapes made of viscous matter.
//!
//! A shape is an object of viscous fluid; moving its boundary dissipates energy, and the least
//! dissipation over all motions with the given motion of the boundary is a Riemannian metric. A
//! shortest path is discretised in time variationally: shapes `O_0, ..., O_K` and deformations
//! `phi_k` of each into the next minimise
//!
//! ```text
//! K sum_k int_{O_{k-1}} W(Dphi_k),      phi_k(O_{k-1}) = O_k,
//! ```
//!
//! where the second derivative of the stored energy `W` at the identity is twice the dissipation of
//! the fluid. The length of the path is `sum sqrt W_k`, its dissipation `K sum W_k`; the square of
//! the length is at most the dissipation, with equality at constant speed.
//!
//! [`geodesic()`] computes such paths in two forms, with one kind of result ([`Geodesic`]):
//!
//! - **[`lagrangian`]** (form B): unknowns are the deformations `psi_k` of the start shape at all
//!   times (or, with the law of the inverse deformations, of the end shape: the same path in other
//!   coordinates, and the better of both is taken), `F = Dpsi_k (Dpsi_{k-1})^-1` is the gradient of `phi_k`, and only the last shape is
//!   matched. In the increments of the path its Hessian is block diagonal up to the mismatch of
//!   their sum, and is inverted by two multigrid cycles; few iterations are needed on every grid.
//!   The topology is that of the start shape. On coarse grids paths are minimised from the identity,
//!   from rotations of the shape after which it looks more like the other one (and is not given up on the coarsest grid), and
//!   from the optimal transport of one shape's volume to the other's, which finds the parts that correspond
//!   where they lie apart; if none of these paths reaches its end, from a viscous flow, too. A path that does not
//!   reach its end on all grids, or tears and joins parts that the shapes have in common, is also computed as deformations
//!   of a shape between both, on which notches that open on the way are half open.
//! - **[`level_sets`]** (form A, the notes'): unknowns are a level set for every shape and all
//!   `phi_k`, and every shape is matched with the next. The initial path is a viscous flow, which
//!   changes the topology if necessary. Motions of the inner shapes that preserve their mismatches
//!   are the soft directions of the energy; the metric has a part for them.
//!
//! A shape may have several components, deformed by one motion, and may be partially hidden
//! ([`Shape`], [`Known`], [`geodesic_between()`]).
//!
//! Both forms are minimised by L-BFGS from `fe-grid`, from coarse grids to fine, each in its own
//! metric. The energy densities are laws of the cell engine: [`PathDissipation`],
//! [`StepDeformation`], [`StepMismatch`], [`ComposedMismatch`], [`BoundaryArea`]. [`finite`] is the
//! same time discretisation without shapes, where geodesics are known.
//!
//! A path can be extended beyond its end, and variations of its start can be transported to its
//! end: see [`calculus`], the discrete exponential map, logarithm and parallel transport.
//!
//! The void around the shapes is soft: it has the stiffness `void_stiffness` under the law, or no
//! stiffness and the viscosity `void_viscosity` instead; then cells of the void may fold, and only
//! those that meet the object must not. The certificate of a result applies to the object.
//!
//! [`boundary_metric`] computes the metric itself, at one shape: the least dissipation of a normal
//! variation, and the optimal velocity.
//!
//! [`distances`] computes statistics of the lengths of many paths: matrices, clusters, maps. A path that is longer than the
//! way through a third shape is not the shortest; [`geodesics_through()`] minimises from that way.
//!
//! Sources: Rumpf and Wirth, *Variational Models in Shape Space and Links to Continuum Mechanics*,
//! section 6; Wirth, Bar, Rumpf and Sapiro, *A Continuum Mechanical Approach to Geodesics in Shape
//! Space* (2011).
//!
//! ```
//! use fe_grid::minimise::Silent;
//! use fe_grid::{Grid, ScalarField};
//! use geodesic::{GeodesicParams, geodesic};
//!
//! let disk = |radius: f64| {
//!     ScalarField::<f64, 2>::from_fn(Grid::dyadic(5), |[x, y]| {
//!         [radius - (x - 0.5).hypot(y - 0.5)]
//!     })
//! };
//! let params = GeodesicParams { steps: 2, ..GeodesicParams::default() };
//! let path = geodesic(&disk(0.2), &disk(0.25), &params, &mut Silent)?;
//! assert!(path.certificate.certified);
//! // A disk of area A(t) that grows: sqrt(4 pi) times the change of its radius.
//! assert!((path.length() - 0.177).abs() < 0.01);
//! # Ok::<(), geodesic::GeodesicError>(())
//! ```
//!
//! The crates whose types are in signatures are re-exported: [`fe_grid`], [`hyperelastic`],
//! [`levelset`].
//!
//! # Features
//! - `clap`: the parameters are options of a command line (`clap::Args`).

#![forbid(unsafe_code)]

mod area;
mod arrival;
mod between;
pub mod boundary_metric;
pub mod calculus;
mod cells;
mod contact;
mod deformation;
mod density;
mod descent;
mod dissipation;
pub mod distances;
mod doubts;
mod end_mismatch;
mod energy;
mod error;
mod extension;
pub mod finite;
mod given;
pub mod lagrangian;
mod laws;
pub mod level_sets;
mod levels;
mod memory;
mod metric;
mod minima;
mod mismatch;
mod near;
mod overlap;
mod params;
mod result;
mod shape;
mod stable;
mod through;
mod transport;

pub use fe_grid;
pub use hyperelastic;
pub use levelset;

pub use area::BoundaryArea;
pub use arrival::Arrival;
pub use between::{geodesic, geodesic_between, geodesic_from, geodesics_both_ways};
pub use cells::ObjectWeights;
pub use contact::{Change, Contact};
pub use deformation::{StepDeformation, StepKinematics};
pub use density::dissipation_density;
pub use dissipation::{PathDissipation, PathKinematics};
pub use energy::PathEnergy;
pub use error::GeodesicError;
pub use given::GivenPath;
pub use lagrangian::Domain;
pub use levels::LevelReport;
pub use memory::{memory_estimate, memory_estimate_of_stability};
pub use minima::{PathMinima, PathMinimum, doubts_of_minima};
pub use mismatch::{
    ComposedMismatch, HeavisideMismatch, MismatchWeights, StepMismatch, Visibility,
};
pub use near::geodesic_near;
pub use overlap::WholeOverlap;
pub use params::{DomainChoice, Form, GeodesicParams};
pub use result::{Geodesic, Middle, certificate_inside};
pub use shape::{Known, Shape};
pub use stable::{StablePath, stable_path};
pub use through::geodesics_through;
pub use transport::transport_cost;

/// The examples of the README are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
