//! Shapes as phase fields: profiles, interface length and mismatch energies, and the edges of grey
//! images.
//!
//! A phase field is 1 away from the boundary of a shape and decreases to 0 on it, over a width of
//! `interface_width` on either side.
//!
//! **Invariant:** a phase field is computed from a signed distance or is the minimiser of an energy
//! of images ([`segmentation`]), never computed from a mask, so that its width is the specified
//! one.
//!
//! ```
//! use phasefield::{ElasticWeight, Profile};
//! let interface_width = 0.01;
//! let profile = Profile::new(interface_width)?;
//! assert_eq!(profile.value(0.0), 0.0);
//! assert!(profile.value(-0.1) > 0.99);
//! let weight = ElasticWeight::new(interface_width, 1e-4)?;
//! assert_eq!((weight.value(0.1), weight.value(-0.1)), (1.0, 1e-4));
//! # Ok::<(), phasefield::PhaseFieldError>(())
//! ```
//!
//! The crates whose types are in signatures are re-exported: [`fe_grid`], [`levelset`].
//!
//! # Features
//! - `clap`: the parameters are options of a command line (`clap::Args`).

#![forbid(unsafe_code)]

mod error;
mod length;
mod mismatch;
pub mod profile;
pub mod segmentation;

pub use fe_grid;
pub use levelset;

pub use error::PhaseFieldError;
pub use length::InterfaceLength;
pub use mismatch::{LeastMismatch, Masked, Mismatch};
pub use profile::{ElasticWeight, Profile};

/// The examples of the README are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
