//! Theory, verified by numerical experiments: what `shapespace verify` runs.
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
//! [`experiments::all`] → [`select`] by name → [`run`]: each [`Statement::run`] in its [`Setting`] →
//! [`Outcome`](outcome::Outcome) → [`Verdict`](verdict::Verdict) → [`record`], [`table`], [`plot`],
//! [`report`].
//!
//! Orders are slopes of least squares with their standard error, limits without a closed form are
//! extrapolated (`order`). No result depends on the number of threads.
//!
//! **Invariant:** records and text come out; no file is written here, and no option is read.

mod error;
pub mod experiments;
mod order;
pub mod outcome;
pub mod plot;
pub mod record;
pub mod report;
mod run;
mod select;
mod statement;
pub mod table;
mod tools;
pub mod verdict;

pub use error::{ExperimentError, UnknownStatement, VerifyError};
pub use run::run;
pub use select::select;
pub use statement::{Effort, Ingredient, Setting, Statement};
