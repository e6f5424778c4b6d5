//! `shapespace verify`: the program as a means to verify theory.
//!
//! Every definition, lemma, theorem and claim of the lecture notes that a run can try is a
//! [`Statement`]: a name, where it stands, what it claims, and an experiment. The experiment finds
//! figures and puts what is expected beside them ([`outcome`]); what that says of the statement is
//! decided in one place ([`verdict`]):
//!
//! - *confirmed*: all figures are as expected, within tolerances that state their reasons;
//! - *not covered*: a hypothesis of the statement does not hold for what the run uses;
//! - *refuted*: a figure is not as expected.
//!
//! A verdict that cannot fail is worth nothing: every statement also has a broken run, in which
//! the same code gets one wrong ingredient (a factor, a law, a weight) and has to end refuted.
//!
//! # Data flow
//! [`experiments::all`] → `select` by name → each [`Statement::run`] in its [`Setting`] →
//! [`Outcome`](outcome::Outcome) → [`Verdict`](verdict::Verdict) → `record`, `table`,
//! `plots`, `report`.
//!
//! Orders are slopes of least squares with their standard error, limits without a closed form are
//! extrapolated (`order`). No result depends on the number of threads.

mod args;
mod command;
mod error;
pub mod experiments;
mod order;
pub mod outcome;
mod plots;
mod record;
mod report;
mod select;
mod statement;
mod table;
mod tools;
pub mod verdict;

pub use args::VerifyArgs;
pub use command::run_verify;
pub use error::VerifyError;
pub use statement::{Effort, Ingredient, Setting, Statement};
