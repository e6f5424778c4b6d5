//! Numbers in a temporary file that is mapped into memory. All unsafe code of memory maps is here.
//!
//! **Invariant:** the file has no name, so that this map is the only way to it and its length never changes;
//! the map begins at a page, and every pattern of bits is a [`Stored`] number, which no other crate implements.

use crate::lane::Stored;
use memmap2::MmapMut;
use std::fs::File;
use std::io::{self, Write};
use std::marker::PhantomData;
use std::path::Path;

/// Numbers in a mapped file, all of it.
#[derive(Debug)]
pub(crate) struct Mapped<T> {
    map: MmapMut,
    numbers: PhantomData<T>,
}

impl<T: Stored> Mapped<T> {
    /// Zeros, in a file of a folder.
    ///
    /// # Errors
    /// Those of the system, for a file that cannot have this size.
    pub fn zeros(folder: &Path, len: usize) -> io::Result<Self> {
        let mut file = tempfile::tempfile_in(folder)?;
        let bytes = len.checked_mul(size_of::<T>());
        let bytes = bytes.ok_or(io::ErrorKind::FileTooLarge)?;
        fill_with_zeros(&mut file, bytes)?;
        // SAFETY: the file has no name, so that nobody else can change or shorten it.
        let map = unsafe { MmapMut::map_mut(&file)? };
        Ok(Self {
            map,
            numbers: PhantomData,
        })
    }

    pub fn as_slice(&self) -> &[T] {
        let len = self.map.len() / size_of::<T>();
        // SAFETY: the map holds that many numbers; it begins at a page, hence aligned, and all
        // bits make a float.
        unsafe { std::slice::from_raw_parts(self.map.as_ptr().cast(), len) }
    }

    pub fn as_mut_slice(&mut self) -> &mut [T] {
        let len = self.map.len() / size_of::<T>();
        // SAFETY: as above, and the map is borrowed for as long as the slice.
        unsafe { std::slice::from_raw_parts_mut(self.map.as_mut_ptr().cast(), len) }
    }

    /// The pages are not needed for a while.
    #[cfg(unix)]
    pub fn rest(&self) {
        // SAFETY: the pages of a shared map of a file are read from the file when they are used
        // again. To be refused is no harm: it is an advice.
        let _ = unsafe {
            self.map
                .unchecked_advise(memmap2::UncheckedAdvice::DontNeed)
        };
    }

    #[cfg(not(unix))]
    pub fn rest(&self) {}
}

/// Writes the zeros out: a file with holes would only fail when it is used, by a signal.
fn fill_with_zeros(file: &mut File, bytes: usize) -> io::Result<()> {
    let zeros = vec![0; bytes.min(1 << 20)];
    let mut left = bytes;
    while left > 0 {
        let part = left.min(zeros.len());
        file.write_all(&zeros[..part])?;
        left -= part;
    }
    file.flush()
}
