//! Work space that outlives a call and is shared by threads.

use std::sync::{Mutex, PoisonError};

/// Buffers that are not in use; a new one is allocated only if none is free.
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

    /// Runs `work` with a buffer for exclusive use; its content is that left by an earlier call.
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
