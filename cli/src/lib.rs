//! The `shapespace` command line as a library: files in, results out.

#![forbid(unsafe_code)]
// These panic where their stream is closed or full; `print.rs` does not.
#![deny(clippy::print_stdout, clippy::print_stderr)]

pub mod api;
pub mod args;
pub mod average;
pub mod calculus;
pub mod check;
mod checkpoint;
pub mod compare;
pub mod config;
pub mod demo;
pub mod distances;
mod doubts;
pub mod error;
mod examples;
pub mod figure;
mod fingerprint;
#[doc(hidden)]
pub mod fuzz;
pub mod generate;
pub mod geodesic;
mod grid;
mod groups;
mod history;
mod integrity;
pub mod interrupt;
pub mod length;
pub mod log;
mod memory;
mod metric;
mod numbers;
pub mod options;
pub mod output;
mod page;
pub mod pca;
mod pool;
mod print;
pub mod processes;
pub mod progress;
mod report;
mod results;
pub mod segment;
mod session;
mod shapes;
mod starts;
mod summary;
pub mod verify;
pub mod warp;
mod watch;

/// The examples of the README, as documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct ReadmeExamples;
