//! Work space that outlives a call and is shared by threads.

use std::sync::{Mutex, PoisonError};

/// Buffers that are not in use; one is made only where none is free.
#[derive(Debug)]
pub(crate) struct Pool<T> {
    free: Mutex<Vec<T>>,
}

impl<T> Pool<T> {
    pub(crate) fn new() -> Self {
        Self {
            free: Mutex::new(Vec::new()),
        }
    }

    /// Runs `work` with a buffer that nobody else holds; what it contains is left over from an
    /// earlier call.
    pub(crate) fn with<R>(&self, make: impl FnOnce() -> T, work: impl FnOnce(&mut T) -> R) -> R {
        // A buffer in the list is whole whatever happened to a thread that held the lock.
        let free = || self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = free().pop();
        let mut buffer = taken.unwrap_or_else(make);
        let result = work(&mut buffer);
        free().push(buffer);
        result
    }
}
