//! Endings of the names of files that are read.

use std::path::Path;

use crate::content::extension_of;
use crate::exact::is_exact;

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
