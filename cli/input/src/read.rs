//! Reads files.

use std::path::{Path, PathBuf};

use crate::content::bytes_of;
use crate::error::InputError;
use crate::format::decode_array;
use crate::grey::GreyRange;
use crate::image::{AnyImage, AnyImages, ReadOptions};
use crate::sources::Sources;

/// Reads one mask.
///
/// # Errors
/// [`InputError`] names the file, the defect and the remedy.
pub fn read_image(path: &Path, options: &ReadOptions) -> Result<AnyImage, InputError> {
    Sources::files().read_image(path, options)
}

/// Reads grey images, as [`Sources::read_grey_images`].
///
/// # Errors
/// [`InputError`] names the file, the defect and the remedy.
pub fn read_grey_images(paths: &[PathBuf]) -> Result<(AnyImages, Vec<GreyRange>), InputError> {
    Sources::files().read_grey_images(paths)
}

/// Reads an array of numbers that the program has written: its size, the last axis first, and its
/// values in memory order.
///
/// # Errors
/// [`InputError`] for files that are no arrays, and values that are not finite.
pub fn read_array(path: &Path) -> Result<(Vec<usize>, Vec<f64>), InputError> {
    decode_array(&bytes_of(path)?, path)
}

/// Reads masks that all have the same number of axes.
///
/// # Errors
/// As [`read_image`], and [`InputError::MixedDimensions`].
pub fn read_images(paths: &[PathBuf], options: &ReadOptions) -> Result<AnyImages, InputError> {
    Sources::files().read_images(paths, options)
}
