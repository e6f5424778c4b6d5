//! Deformations in the world: as displacement fields for other programs (`fields`), with their changes of volume
//! (`jacobian`), and
//! `shapespace warp` (`command`), which carries images (`samples`, `images`) and points (`points`) between
//! two shapes (`way`) of a result (`map`) by its deformations (`route`); `draw` and `record` show what was carried.

mod command;
mod draw;
mod fields;
mod images;
mod jacobian;
mod map;
mod points;
mod record;
mod route;
mod samples;
mod way;

pub use command::{Interpolation, WarpArgs, run_warp};
pub(crate) use fields::{Space, write_images, write_labels, write_shape, write_steps_in_world};
pub(crate) use images::between;
pub(crate) use jacobian::write_warps;
pub(crate) use map::StoredMap;
pub(crate) use samples::carried;
pub use way::Way;
