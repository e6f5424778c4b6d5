//! Commands for other programs: inputs as files or as arrays in memory, results as arrays.
//!
//! A [`Call`] is what a command line is: a command, its options by the names of its configuration,
//! and its inputs by name. A name is that of an array among the [`Sources`], or else the path of a
//! file. [`Call::run`] goes the way of the command line: the same plan, the same computation, and
//! the same code that lists what a result consists of. Only the last step differs: the arrays and
//! the record are kept ([`Computed`]) instead of written, and nothing is drawn. Hence the same bits,
//! by construction. [`Computed::save`] writes the directory of the command line afterwards.
//!
//! A command that starts from a result (`pca`, `score`, `synthesize`, `extend`, `transport`) reads
//! the directory of that result, also here, so that it starts from the same bits.
//!
//! Nothing here prints, answers signals, or ends the process. A caller hears of the work by a
//! [`Listener`], on the thread of the computation, and ends it by a [`Stop`].
//!
//! `call` runs commands, `computed` holds results, `warped` carries images and points through
//! deformations, `verified` runs the experiments of `shapespace verify`.

mod call;
mod computed;
mod verified;
mod warped;

pub use call::{COMMANDS, Call, Checkpoints, Stop, keys, memory};
pub use computed::Computed;
pub use verified::{Trial, Verified};
pub use warped::{Warp, Warped};

pub use crate::error::CliError;
pub use crate::output::{KeptArray, KeptNumbers};
pub use crate::progress::{Event, Listener};
pub use crate::warp::{Interpolation, Way};
pub use shapespace_input::{ArrayType, NamedArray, Sources, check_count};
