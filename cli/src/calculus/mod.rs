//! `shapespace extend` and `shapespace transport`: continuation of geodesics, and parallel
//! transport of variations.
//!
//! `read` reads the directory of a geodesic, `extend` and `transport` compute and write, `record`
//! is the content of `result.json`. Shapes, pictures and tables are written as for a geodesic.

mod args;
mod extend;
mod read;
mod record;
mod transport;

pub(crate) use read::read as read_path;

pub use args::{ExtendConfig, TransportConfig};
