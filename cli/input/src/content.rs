//! The bytes of files, and the memory of what they hold.

use std::path::Path;

use crate::error::InputError;
use crate::exact::is_exact;
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

/// Extensions of images, in small letters.
const IMAGES: [&str; 18] = [
    "npy", "nii", "hdr", "img", "nrrd", "nhdr", "mha", "mhd", "tif", "tiff", "png", "jpg", "jpeg",
    "pgm", "pbm", "ppm", "pnm", "bmp",
];
/// The ending of a compressed image.
const COMPRESSED: &str = ".nii.gz";

/// Whether files of this name hold images, by its ending.
pub(crate) fn is_image(name: &str) -> bool {
    let name = name.to_lowercase();
    let extension = extension_of(Path::new(&name));
    name.ends_with(COMPRESSED) || IMAGES.contains(&&*extension)
}

/// The name of a file without the ending of a format that is read.
pub fn without_ending(name: &str) -> &str {
    let extension = extension_of(Path::new(name));
    let ending = if name.to_lowercase().ends_with(COMPRESSED) {
        COMPRESSED.len()
    } else if IMAGES.contains(&&*extension) || is_exact(&extension) {
        1 + extension.len()
    } else {
        0
    };
    // Endings are ASCII: the text before them ends at a character boundary.
    name.get(..name.len() - ending).unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings_of_formats_are_left_out() {
        for (name, without) in [
            ("a.nii.gz", "a"),
            ("a.NII.GZ", "a"),
            ("größe.Png", "größe"),
            ("a.b.stl", "a.b"),
            ("a.gz", "a.gz"),
            ("v1.2", "v1.2"),
            ("ſ.nii.gz", "ſ"),
            ("", ""),
        ] {
            assert_eq!(without_ending(name), without);
        }
        assert!(
            is_image("A.NII.gz") && is_image("a.bmp") && !is_image("a.stl") && !is_image("png")
        );
    }
}
