//! `shapespace verify`: the theory, checked by the experiments of `shapespace_verify`.
//!
//! `args` are the options, `command` runs the experiments and writes the result directory, `journal` keeps
//! outcomes across interruptions.

mod args;
mod command;
mod journal;

pub use args::VerifyArgs;
pub use command::run_verify;
pub(crate) use command::{selected, tried, write_all};
