//! Limits of inputs.

/// No input may have more values than this (2 GiB in double precision).
pub const MAX_VALUES: u64 = 1 << 28;
