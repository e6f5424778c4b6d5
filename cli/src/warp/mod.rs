//! Deformations in the world: as displacement fields for other programs (`fields`), and
//! `shapespace warp` (`command`), which carries images and points (`points`) by them (`map`).

mod command;
mod fields;
mod map;
mod points;

pub(crate) use command::carried;
pub use command::{Interpolation, WarpArgs, run_warp};
pub(crate) use fields::{write_shape, write_warps};
pub(crate) use map::StoredMap;
