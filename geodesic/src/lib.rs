//! Geodesics in a space of 2D and 3D shapes made of viscous matter.

mod dissipation;
mod error;
pub mod lagrangian;
mod matching;
mod params;

pub use dissipation::PathDissipation;
pub use error::GeodesicError;
pub use matching::HeavisideMatch;
pub use params::GeodesicParams;
