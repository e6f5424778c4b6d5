//! Long vectors, in memory or in a temporary file that is mapped into memory.
//!
//! A mapped vector is read and written like any other; the operating system decides which parts are
//! held in memory. The file has no name: it is removed with the vector, even if the program is
//! killed.

use crate::error::GridError;
use crate::lane::Stored;
use crate::mapped::Mapped;
use std::ops::{Deref, DerefMut};
use std::path::PathBuf;

/// Storage of long vectors.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Storage {
    /// In memory.
    #[default]
    Memory,
    /// In temporary files of a folder.
    Folder(PathBuf),
}

impl Storage {
    /// Creates a vector of zeros.
    ///
    /// # Errors
    /// [`GridError::Spill`] if a file of this size cannot be created.
    pub fn zeros<T: Stored>(&self, len: usize) -> Result<Buffer<T>, GridError> {
        match self {
            Self::Folder(folder) if len > 0 => {
                let mapped = Mapped::zeros(folder, len).map_err(|error| GridError::Spill {
                    folder: folder.clone(),
                    bytes: (len as u64).saturating_mul(size_of::<T>() as u64),
                    reason: error.to_string(),
                })?;
                Ok(Buffer(Place::Mapped(mapped)))
            }
            _ => Ok(Buffer::zeros(len)),
        }
    }
}

/// A long vector of fixed length: a slice of numbers, in memory or in a file.
#[derive(Debug)]
pub struct Buffer<T>(Place<T>);

#[derive(Debug)]
enum Place<T> {
    Memory(Vec<T>),
    Mapped(Mapped<T>),
}

impl<T: Stored> Buffer<T> {
    /// A vector of zeros in memory.
    pub fn zeros(len: usize) -> Self {
        Self(Place::Memory(vec![T::default(); len]))
    }

    /// The vector is not needed for a while: one in a file takes no room in memory until it is
    /// used again. Its numbers stay.
    pub fn rest(&self) {
        if let Place::Mapped(mapped) = &self.0 {
            mapped.rest();
        }
    }
}

impl<T: Stored> Deref for Buffer<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.0 {
            Place::Memory(vector) => vector,
            Place::Mapped(mapped) => mapped.as_slice(),
        }
    }
}

impl<T: Stored> DerefMut for Buffer<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.0 {
            Place::Memory(vector) => vector,
            Place::Mapped(mapped) => mapped.as_mut_slice(),
        }
    }
}

impl<T: Stored> Clone for Buffer<T> {
    /// The same numbers in memory.
    fn clone(&self) -> Self {
        self.to_vec().into()
    }
}

impl<T: Stored> PartialEq for Buffer<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Stored> From<Vec<T>> for Buffer<T> {
    fn from(vector: Vec<T>) -> Self {
        Self(Place::Memory(vector))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mapped_vector_keeps_its_numbers_and_leaves_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let storage = Storage::Folder(folder.path().into());
        // More than a block of zeros, and no whole number of pages.
        let len = (1 << 18) + 7;
        let mut mapped = storage.zeros::<f64>(len).unwrap();
        assert!(mapped.iter().all(|&x| x == 0.0) && mapped.len() == len);
        for (i, x) in mapped.iter_mut().enumerate() {
            *x = i as f64;
        }
        mapped.rest();
        assert!(mapped.iter().enumerate().all(|(i, &x)| x == i as f64));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        assert_eq!(storage.zeros::<f32>(0).unwrap().len(), 0);
    }

    #[test]
    fn a_vector_in_memory_is_a_vector() {
        let mut vector = Storage::Memory.zeros::<f32>(3).unwrap();
        vector[1] = 2.0;
        vector.rest();
        assert_eq!(*vector, [0.0, 2.0, 0.0]);
        assert_eq!(vector.clone(), vec![0.0, 2.0, 0.0].into());
    }

    #[test]
    fn a_folder_that_does_not_exist_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let storage = Storage::Folder(folder.path().join("nowhere"));
        let error = storage.zeros::<f32>(10).unwrap_err();
        assert!(
            matches!(error, GridError::Spill { bytes: 40, .. }),
            "{error}"
        );
    }
}
