//! The bytes of files, and the memory of what they hold.

use std::path::Path;

use crate::error::InputError;
use crate::{files, memory};

/// The bytes of a regular file, for which there is memory.
///
/// # Errors
/// [`InputError::Unreadable`], [`InputError::Memory`].
pub fn bytes_of(path: &Path) -> Result<Vec<u8>, InputError> {
    let unreadable = |source| InputError::Unreadable {
        path: path.into(),
        source,
    };
    let length = std::fs::metadata(path).map_err(unreadable)?.len();
    reserve(path, length, 0)?;
    files::read(path, length).map_err(unreadable)
}

/// Asks for the memory of an input before it is allocated: so many bytes, of which some are kept.
pub(crate) fn reserve(path: &Path, needed: u64, kept: u64) -> Result<(), InputError> {
    memory::reserve(needed, kept).map_err(|shortage| InputError::Memory {
        path: path.into(),
        needed: shortage.needed,
        limit: shortage.limit,
    })
}

/// The extension of a file, in small letters; empty where there is none.
pub fn extension_of(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default();
    extension.to_string_lossy().to_lowercase()
}
