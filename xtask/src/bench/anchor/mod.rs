//! A hand-written kernel in C, compiled and run beside ours, and its arithmetic as a law.

mod law;
mod program;

pub use law::AnchorLaw;
pub use program::{Anchor, Figure};
