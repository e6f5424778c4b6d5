//! Polyconvex stored energy densities, pointwise and vectorised, in 2D and 3D.
//!
//! A law `W` maps the displacement gradient `h = Dphi - 1` at a point to its energy density, first
//! Piola–Kirchhoff stress and tangent ([`StoredEnergy`]). It is generic over the lane type, so the
//! formula that is evaluated as plain `f64` in a test is evaluated on eight cells at a time in
//! production.
//!
//! | law | name | moduli |
//! |---|---|---|
//! | [`LogDet`] | `logdet`, the default | all |
//! | [`LogDetBarrier`] | `logdet_barrier` | all |
//! | [`Power`] | `power` | all |
//! | [`Power::two_term`] | `power_two_term` | `lambda / mu` above a bound |
//! | [`Inverse`] | `inverse:logdet`, ... | those of its base |
//! | [`LinearElasticity`] | `linear` | all |
//! | [`SeedLiteral`] | – | for value checks |
//!
//! Beside the laws stand [`ViscousDissipation`], with which they are consistent, and
//! [`cauchy_stress`]. [`WeightedElasticity`] makes a law an energy of the cell engine, for an object
//! in a soft void; [`Corotational`] is the quadratic form that metrics for such energies are made
//! of, with [`CorotationalMultigrid`] as its inverse, and [`FoldBarrier`] keeps the corners of cells from folding.
//!
//! **Invariants:** laws do not depend on a mesh; there is no input or output; all functions called
//! by a law are inlined and use lane arithmetic only, so that they are compiled for the instruction
//! set chosen at run time.
//!
//! ```
//! use hyperelastic::{LameModuli, LawSpec};
//!
//! // The energy of a stretch by 10 % along the first axis.
//! let stretch = [[0.1, 0.0], [0.0, 0.0]];
//! let moduli = LameModuli::new(1.0, 1.0)?;
//! let elastic = LawSpec::new("logdet", moduli)?.compile::<2>()?.value(&stretch);
//! let linear = LawSpec::new("linear", moduli)?.compile::<2>()?.value::<f64>(&stretch);
//! assert!((elastic / linear - 1.0).abs() < 0.1);
//! # Ok::<(), hyperelastic::LawError>(())
//! ```
//!
//! The crates whose types are in signatures are re-exported: [`fe_grid`].
//!
//! # Features
//! - `clap`: the parameters are options of a command line (`clap::Args`).

#![forbid(unsafe_code)]

mod cauchy;
mod compiled;
mod corotational;
mod corotational_operator;
mod dissipation;
mod error;
mod fold_barrier;
mod hypotheses;
mod inverse;
mod isotropic;
mod kinematics;
mod linear_elasticity;
mod logdet;
mod logdet_barrier;
mod moduli;
mod own_law;
mod power;
mod power_options;
mod power_share;
mod registry;
mod scalar;
mod seed_literal;
mod stored_energy;
mod strain_energy;
mod terms;
mod weighted;

pub use fe_grid;

pub use cauchy::cauchy_stress;
pub use compiled::CompiledLaw;
pub use corotational::{Corotational, polar_rotation};
pub use corotational_operator::{CorotationalMultigrid, CorotationalOperator, CycleMemory};
pub use dissipation::ViscousDissipation;
pub use error::LawError;
pub use fold_barrier::FoldBarrier;
pub use hypotheses::{Growth, Hypotheses};
pub use inverse::Inverse;
pub use linear_elasticity::LinearElasticity;
pub use logdet::LogDet;
pub use logdet_barrier::LogDetBarrier;
pub use moduli::LameModuli;
pub use own_law::OwnLaw;
pub use power::{Power, PowerCoefficients, PowerExponents};
pub use power_options::PowerOptions;
pub use registry::{Family, LawName, LawSpec, register_law};
pub use seed_literal::{SeedLiteral, SeedParameters};
pub use stored_energy::{PolyconvexForm, StoredEnergy};
pub use strain_energy::{StrainDensity, StrainEnergy};
pub use weighted::WeightedElasticity;

/// The examples of the README are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
