//! The outcome of a task.

use std::error::Error;

/// A result, or why there is none.
pub type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;
