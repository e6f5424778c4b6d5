//! Checksums of the files of result directories: written with a result, verified by whoever reads it.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use fe_grid::parallel;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::error::CliError;
use crate::output::{OutputError, ResultDir, is_as_written, sealed_text, sum_of};
use crate::report::RESULT;
use shapespace_input::files::read_text;
use shapespace_input::files_of;

/// The key of the checksums in a record.
const ARRAYS: &str = "arrays";
/// The key of the files that were carried.
const CARRIED: &str = "carried";
/// The key of the checksum of an input.
const INPUT_SUM: &str = "sha256";
/// What is wrong with a file of another checksum.
const CHANGED: &str = "its contents have changed since the result was written";

/// The SHA-256 of a regular file, in hexadecimal digits.
///
/// # Errors
/// Those of the system.
pub(crate) fn sum_of_file(path: &Path) -> io::Result<String> {
    sum_of_files(&[path.into()])
}

/// The SHA-256 of all files of an input, one after the other.
///
/// # Errors
/// Those of the system.
pub(crate) fn sum_of_input(path: &Path) -> io::Result<String> {
    sum_of_files(&files_of(path))
}

fn sum_of_files(files: &[PathBuf]) -> io::Result<String> {
    let mut hasher = Sha256::new();
    for path in files {
        let metadata = fs::metadata(path)?;
        if !metadata.is_file() {
            return Err(io::ErrorKind::InvalidInput.into());
        }
        // Some files of the system have no end.
        let mut file = File::open(path)?.take(metadata.len());
        io::copy(&mut file, &mut hasher)?;
    }
    Ok(format!("{:x}", hasher.finalize()))
}

/// Endings of arrays, which results are read from.
const ARRAY_FILES: [&str; 2] = ["npy", "bin"];
/// Endings of files that other programs read: volumes, surfaces and drawings. Tables may have times, and are opened and
/// saved by other programs.
const OTHER_FILES: [&str; 7] = ["gz", "vti", "vtp", "stl", "ply", "svg", "geojson"];

/// Whether a file has one of these endings.
fn ends_in(name: &str, endings: &[&str]) -> bool {
    let ending = Path::new(name)
        .extension()
        .and_then(|ending| ending.to_str());
    ending.is_some_and(|ending| endings.contains(&ending))
}

/// Names of all files of a directory and of its folders with one of these endings, with slashes.
fn files_in(directory: &Path, within: &str, endings: &[&str]) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(directory)? {
        let entry = entry?;
        let name = format!("{within}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            names.extend(files_in(&entry.path(), &format!("{name}/"), endings)?);
        } else if ends_in(&name, endings) {
            names.push(name);
        }
    }
    Ok(names)
}

/// Adds to the record of a complete directory the checksums of its arrays, volumes, surfaces and drawings, of the files
/// that `warp` carried, those of the files of its inputs, where these still exist, and its own.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn seal(directory: &ResultDir) -> Result<(), OutputError> {
    let path = directory.file(RESULT);
    let failed = OutputError::at(&path);
    let text = fs::read(&path).map_err(&failed)?;
    let mut record: Value = serde_json::from_slice(&text).map_err(|e| failed(e.into()))?;
    let mut sums = Sums::compute(directory.path())
        .map_err(&failed)?
        .arrays
        .unwrap_or_default();
    for name in carried(&record) {
        let sum = sum_of_file(&directory.file(name)).map_err(&failed)?;
        sums.insert(name.into(), sum);
    }
    record[ARRAYS] = serde_json::json!(sums);
    let inputs = record.get_mut("input").and_then(Value::as_array_mut);
    for input in inputs.into_iter().flatten() {
        let file = input["path"].as_str().map(Path::new);
        if let Some(sum) = file.and_then(|file| sum_of_input(file).ok()) {
            input[INPUT_SUM] = sum.into();
        }
    }
    fs::write(&path, sealed_text(&path, &record)?).map_err(failed)
}

/// Names of the files of a directory that were carried there.
fn carried(record: &Value) -> impl Iterator<Item = &str> {
    let carried = record.get(CARRIED).and_then(Value::as_array);
    carried
        .into_iter()
        .flatten()
        .filter_map(|file| file["result"].as_str())
}

/// The checksums that the record of a directory states.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Sums {
    /// By the names of the files; none in results of earlier versions.
    #[serde(default)]
    arrays: Option<BTreeMap<String, String>>,
    /// Whether the record is the one that was written, as far as it is known.
    #[serde(skip)]
    as_written: Option<bool>,
    /// Whether they are not verified.
    #[serde(skip)]
    trusted: bool,
}

impl Sums {
    /// Those of a directory; none where it has no record.
    ///
    /// # Errors
    /// [`CliError::Damaged`] where the record cannot be read, or has been changed.
    pub fn of(directory: &Path, trusted: bool) -> Result<Self, CliError> {
        let path = directory.join(RESULT);
        if !path.exists() {
            return Ok(Self::default());
        }
        let text = read_text(&path).unwrap_or_default();
        let as_written = is_as_written(&text);
        let reason = match serde_json::from_str::<Self>(&text) {
            Ok(sums) if trusted || as_written != Some(false) => {
                return Ok(Self {
                    as_written,
                    trusted,
                    ..sums
                });
            }
            Err(_) if trusted => return Ok(Self::default()),
            Ok(_) => CHANGED.into(),
            Err(error) => error.to_string(),
        };
        Err(CliError::Damaged { path, reason })
    }

    /// Whether the record is the one that was written, as far as it is known.
    pub fn as_written(&self) -> Option<bool> {
        self.as_written
    }

    /// Those of the arrays, volumes, surfaces and drawings that lie in a folder.
    ///
    /// # Errors
    /// Those of the system.
    pub fn compute(folder: &Path) -> io::Result<Self> {
        let files = files_in(folder, "", &[&ARRAY_FILES[..], &OTHER_FILES].concat())?;
        let sums = parallel::try_map(files, &|name| {
            let sum = sum_of_file(&folder.join(&name))?;
            Ok::<_, io::Error>((name, sum))
        })?;
        Ok(Self {
            arrays: Some(sums.into_iter().collect()),
            ..Self::default()
        })
    }

    /// Verifies the bytes of an array.
    ///
    /// # Errors
    /// [`CliError::Damaged`] for an array that is not the one of the record.
    pub fn verify(&self, directory: &Path, name: &Path, bytes: &[u8]) -> Result<(), CliError> {
        let Some(arrays) = self.arrays.as_ref().filter(|_| !self.trusted) else {
            return Ok(());
        };
        let reason = match arrays.get(&*name.to_string_lossy()) {
            Some(sum) if *sum == sum_of(bytes) => return Ok(()),
            Some(_) => CHANGED,
            None => "the record of the result does not list it",
        };
        Err(CliError::Damaged {
            path: directory.join(name),
            reason: reason.into(),
        })
    }

    /// One checksum of all arrays, by which other results name this one.
    pub fn digest(&self) -> Option<String> {
        let arrays = self.arrays.as_ref()?.iter();
        let arrays = arrays.filter(|(name, _)| ends_in(name, &ARRAY_FILES));
        let lines = arrays.map(|(name, sum)| format!("{sum}  {name}\n"));
        Some(sum_of(lines.collect::<String>().as_bytes()))
    }

    /// Checks that this is the directory that another result names by its digest.
    ///
    /// # Errors
    /// [`CliError::Damaged`] for any other.
    pub fn is(&self, named: Option<&str>, own: &Path, other: &Path) -> Result<(), CliError> {
        match (named, self.digest()) {
            (Some(named), Some(digest)) if named != digest && !self.trusted => {
                Err(CliError::Damaged {
                    path: own.into(),
                    reason: format!("'{}' was computed from another average", other.display()),
                })
            }
            _ => Ok(()),
        }
    }

    /// All names with their checksums.
    pub fn iter(&self) -> impl Iterator<Item = (&String, &String)> {
        self.arrays.iter().flatten()
    }

    /// Numbers of the arrays of a kind, such as `deformation_001.npy`, that are listed.
    pub fn numbers(&self, kind: &str) -> Vec<usize> {
        let number = |name: &String| {
            let rest = name.strip_prefix(kind)?.strip_prefix('_')?;
            rest.strip_suffix(".npy")?.parse().ok()
        };
        self.iter().filter_map(|(name, _)| number(name)).collect()
    }

    /// Whether the record has checksums.
    pub fn exist(&self) -> bool {
        self.arrays.is_some()
    }
}

/// Names of the arrays of a directory that its record does not list.
///
/// # Errors
/// Those of the system.
pub(crate) fn unlisted(directory: &Path, sums: &Sums) -> io::Result<Vec<String>> {
    let mut names = files_in(directory, "", &ARRAY_FILES)?;
    names.retain(|name| !sums.iter().any(|(listed, _)| listed == name));
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_sealed_and_verified() {
        let place = tempfile::tempdir().unwrap();
        let directory = ResultDir::create(&place.path().join("out")).unwrap();
        fs::write(directory.file("a.npy"), "abc").unwrap();
        fs::create_dir(directory.file("inputs")).unwrap();
        fs::write(directory.file("inputs/b.npy"), "").unwrap();
        fs::write(
            directory.file(RESULT),
            r#"{"input": [{"path": "nowhere"}]}"#,
        )
        .unwrap();
        seal(&directory).unwrap();
        let path = directory.commit().unwrap();
        let sums = Sums::of(&path, false).unwrap();
        // FIPS 180-4, the first example.
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        let listed: Vec<_> = sums.iter().collect();
        assert_eq!(listed[0], (&"a.npy".to_owned(), &abc.to_owned()));
        assert_eq!(listed[1].0, "inputs/b.npy");
        assert_eq!(sum_of_file(&path.join("a.npy")).unwrap(), abc);
        let verify = |sums: &Sums, name: &str, bytes: &[u8]| {
            sums.verify(&path, Path::new(name), bytes).is_ok()
        };
        assert!(verify(&sums, "a.npy", b"abc"));
        assert!(!verify(&sums, "a.npy", b"abd"));
        assert!(!verify(&sums, "c.npy", b"abc"));
        assert!(verify(&Sums::of(&path, true).unwrap(), "a.npy", b"abd"));
        assert!(verify(&Sums::default(), "a.npy", b"abd"));
        assert!(unlisted(&path, &sums).unwrap().is_empty());
        // Headers with their data.
        let header = path.join("a.mhd");
        fs::write(&header, "ElementDataFile = a.npy").unwrap();
        let both = sum_of(b"ElementDataFile = a.npyabc");
        assert_eq!(sum_of_input(&header).unwrap(), both);
        fs::write(path.join("c.npy"), "").unwrap();
        assert_eq!(unlisted(&path, &sums).unwrap(), ["c.npy"]);
        assert_eq!(sums.as_written(), Some(true));
        let digest = sums.digest();
        assert!(sums.is(digest.as_deref(), &path, &path).is_ok());
        assert!(sums.is(Some("other"), &path, &path).is_err());
        assert!(sums.is(None, &path, &path).is_ok());
        let text = fs::read_to_string(path.join(RESULT)).unwrap();
        let other = text.replace("nowhere", "elsewhere");
        for (text, as_written) in [(&*other, Some(false)), ("{}", None), ("{", None)] {
            fs::write(path.join(RESULT), text).unwrap();
            assert_eq!(Sums::of(&path, false).is_ok(), text == "{}");
            let trusted = Sums::of(&path, true).unwrap();
            assert_eq!(trusted.as_written(), as_written);
        }
        assert!(Sums::of(&path, true).is_ok());
    }
}
