//! The `shapespace` program.

fn main() {}
