//! Files are read whole, once their type and length have been checked.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Greatest length of texts: records, configurations and lists.
const TEXT: u64 = 1 << 26;

/// Reads a regular file of at most so many bytes. Nothing waits for a pipe, and nothing reads a
/// device without end.
///
/// # Errors
/// [`Error`] of the system, and one for anything but a regular file of this length.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>> {
    // Opening a pipe would wait for its writer.
    check(&std::fs::metadata(path)?, most)?;
    let file = File::open(path)?;
    // The name may be another file by now, and a file may grow.
    let length = check(&file.metadata()?, most)?;
    let mut bytes = Vec::new();
    let room = usize::try_from(length).map_err(|_| too_long(length, most))?;
    bytes
        .try_reserve_exact(room)
        .map_err(|_| Error::from(ErrorKind::OutOfMemory))?;
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads a text.
///
/// # Errors
/// As [`read`], and for bytes that are not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path, TEXT)?)
        .map_err(|_| Error::new(ErrorKind::InvalidData, "it is not text in UTF-8"))
}

/// The length of a regular file.
fn check(metadata: &std::fs::Metadata, most: u64) -> Result<u64> {
    let kind = metadata.file_type();
    if kind.is_dir() {
        return Err(Error::new(ErrorKind::IsADirectory, "it is a folder"));
    }
    if !kind.is_file() {
        let what = "it is a pipe or a device, not a file";
        return Err(Error::new(ErrorKind::InvalidInput, what));
    }
    let length = metadata.len();
    if length > most {
        return Err(too_long(length, most));
    }
    Ok(length)
}

fn too_long(length: u64, most: u64) -> Error {
    let text = format!("it has {length} bytes, more than the limit of {most}");
    Error::new(ErrorKind::FileTooLarge, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_a_known_length_are_read() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a");
        std::fs::write(&path, "12345").unwrap();
        assert_eq!(read(&path, 5).unwrap(), b"12345");
        let kind = |path: &Path, most| read(path, most).unwrap_err().kind();
        assert_eq!(kind(&path, 4), ErrorKind::FileTooLarge);
        assert_eq!(kind(place.path(), 9), ErrorKind::IsADirectory);
        assert_eq!(kind(&place.path().join("b"), 9), ErrorKind::NotFound);
        #[cfg(unix)]
        assert_eq!(kind(Path::new("/dev/zero"), 9), ErrorKind::InvalidInput);
        std::fs::write(&path, [0xff, 0xfe]).unwrap();
        assert_eq!(read_text(&path).unwrap_err().kind(), ErrorKind::InvalidData);
    }
}
