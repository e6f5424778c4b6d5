//! Signed distances, contours, surfaces and measures of 2D and 3D shapes.
//!
//! A shape is the set `{u > level}` of a scalar field on a grid. Its boundary is a
//! [`Contour`]: oriented segments in 2D, oriented triangles in 3D, with one generic type for both.
//! Signed distances are positive **inside** the object and measure the exact Euclidean distance to
//! that contour.
//!
//! **Invariant:** this crate does not minimise, and does not read or write files.
//!
//! The crates whose types are in signatures are re-exported: [`fe_grid`], [`nalgebra`].

#![forbid(unsafe_code)]

mod bvh;
mod closest;
mod components;
mod continued;
pub mod contour;
pub mod criteria;
pub mod distance;
mod error;
mod extract;
mod facing;
mod farthest;
mod hausdorff;
pub mod heaviside;
pub mod inspect;
pub mod measures;
mod nearest_motion;
pub mod polygon;
mod polyline;
mod pseudonormal;
mod quad;
pub mod rigid_motion;
mod search;
mod surface;
pub mod topology;
mod turn;
mod vector;
pub mod verdict;

pub use fe_grid;
pub use nalgebra;

pub use components::{Components, connected_components, largest_component};
pub use continued::Continued;
pub use contour::{Contour, bounds, centroid};
pub use criteria::{Cause, Criterion, Limit};
pub use distance::{ContourDistance, Nearest, signed_distance};
pub use error::LevelsetError;
pub use extract::{BoxEdge, contour};
pub use facing::{Facing, Layer, facing};
pub use hausdorff::{Hausdorff, directed_hausdorff, hausdorff};
pub use heaviside::{Arctan, Compact, Step};
pub use measures::{
    Moments, dice, dice_within, enclosed_volume, is_mask, mask_volume, share_outside,
};
pub use polyline::{Polyline, svg_path};
pub use rigid_motion::RigidMotion;
pub use turn::Turn;
pub use verdict::{Doubt, Verdict};

/// The examples of the README are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
