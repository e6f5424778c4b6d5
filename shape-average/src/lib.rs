//! The elastic average of 2D and 3D shapes.

pub mod align;
