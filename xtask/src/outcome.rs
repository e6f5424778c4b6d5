//! The outcome of a task.

use std::error::Error;

/// A result, or the error.
pub type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;
