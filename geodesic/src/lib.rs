//! Geodesics in a space of 2D and 3D shapes made of viscous matter.

mod area;
mod cells;
mod deformation;
mod dissipation;
mod error;
pub mod finite;
pub mod lagrangian;
mod laws;
pub mod level_sets;
mod matching;
mod metric;
mod params;
mod result;

pub use area::BoundaryArea;
pub use deformation::StepDeformation;
pub use dissipation::PathDissipation;
pub use error::GeodesicError;
pub use matching::{HeavisideMatch, MatchWeights, MeasuredMatch, StepMatch};
pub use params::{Form, GeodesicParams};
pub use result::{Geodesic, LevelReport, geodesic};
