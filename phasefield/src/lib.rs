//! Shapes as phase fields: profiles, interface length and mismatch energies.
//!
//! A phase field is 1 away from the boundary of a shape and falls to 0 on it, over a width
//! `interface_width` on either side.

mod error;
mod length;
mod mismatch;
pub mod profile;

pub use error::PhaseFieldError;
pub use length::InterfaceLength;
pub use mismatch::Mismatch;
pub use profile::{ElasticWeight, Profile};
