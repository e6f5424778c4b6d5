//! Numerical experiments that check the theory: the library of `shapespace verify`.
//!
//! Every definition, lemma, theorem and claim of the lecture notes that can be checked numerically
//! is a [`Statement`]: a name, its reference, its claim, and an experiment. The experiment computes
//! measured and expected values ([`outcome`]); the verdict on the statement is decided in one place
//! ([`verdict`]):
//!
//! - *confirmed*: all values are as expected, within tolerances that state their reasons;
//! - *not covered*: a hypothesis of the statement does not hold for the data of the run;
//! - *refuted*: a value is not as expected.
//!
//! An experiment must be able to fail: every statement also has a broken run, in which the same
//! code gets one wrong ingredient (a factor, a law, a weight) and must be refuted.
//!
//! Whether the experiments notice errors in the crates is tried in the same way: `fe_grid::mutants` lists
//! errors that are built in and can be switched on in tests, each with the statement that claims to find
//! it (`tests/mutants.rs`, `examples/mutant.rs`, `cargo xtask mutants`).
//!
//! # Data flow
//! [`experiments::all`] → [`select()`] by name → [`run`]: each [`Statement::run`] in its [`Setting`] →
//! [`Outcome`] → [`Verdict`](verdict::Verdict) → [`record`], [`table`], [`plot`],
//! [`report`].
//!
//! Orders are least-squares slopes with their standard error, limits without a closed form are
//! extrapolated (`order`). No result depends on the number of threads.
//!
//! **Invariant:** the results are records and text; no file is written here, and no option is read.

#![forbid(unsafe_code)]

mod error;
pub mod experiments;
pub mod order;
pub mod outcome;
pub mod plot;
pub mod record;
pub mod report;
mod run;
pub mod select;
mod statement;
pub mod table;
pub mod tools;
pub mod verdict;

pub use error::{ExperimentError, UnknownStatement, VerifyError};
pub use outcome::Outcome;
pub use run::{Journal, NoJournal, run};
pub use select::select;
pub use statement::{Effort, Ingredient, Setting, Statement};
