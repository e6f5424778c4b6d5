//! Deformations in the world: as displacement fields for other programs (`fields`).

mod fields;

pub(crate) use fields::{write_shape, write_warps};
