//! Checksums of the files of a release.

use std::fmt::Write;
use std::path::Path;
use std::{fs, io};

use sha2::{Digest, Sha256};

use super::step::Step;

const NAME: &str = "SHA256SUMS";

/// Writes the sums in the form that `sha256sum --check` reads.
pub fn write(folder: &Path) -> Step {
    match written(folder) {
        Ok(n) => Step::Done(format!("{NAME} of {n} files in {}", folder.display())),
        Err(error) => Step::Failed(error.to_string()),
    }
}

fn written(folder: &Path) -> io::Result<usize> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.file_type()?.is_file() && name != NAME {
            names.push(name);
        }
    }
    names.sort();
    let mut text = String::new();
    for name in &names {
        let digest = Sha256::digest(fs::read(folder.join(name))?);
        for byte in digest {
            // Writing to a text does not fail.
            let _ = write!(text, "{byte:02x}");
        }
        let _ = writeln!(text, "  {name}");
    }
    fs::write(folder.join(NAME), text)?;
    Ok(names.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_sha256sum() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("b"), "").unwrap();
        fs::write(folder.path().join("a"), "abc").unwrap();
        assert_eq!(written(folder.path()).unwrap(), 2);
        // A second time the sums are not summed.
        assert_eq!(written(folder.path()).unwrap(), 2);
        let text = fs::read_to_string(folder.path().join(NAME)).unwrap();
        assert_eq!(
            text,
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  a\n\
             e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855  b\n"
        );
    }
}
