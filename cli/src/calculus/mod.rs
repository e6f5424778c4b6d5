//! `shapespace extend` and `shapespace transport`: geodesics that go on, and variations that are
//! carried along them.
//!
//! `read` reads the directory of a geodesic back, `extend` and `transport` compute and write,
//! `record` is what `result.json` tells. Shapes, pictures and tables are written as for a geodesic.

mod args;
mod extend;
mod read;
mod record;
mod transport;

pub use args::{ExtendArgs, ExtendConfig, TransportArgs, TransportConfig};
pub use extend::run_extend;
pub use transport::run_transport;
