//! Interrupted results, which give way to later ones of the same name.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use shapespace_input::files::read_text;

use super::OutputError;
use super::staging::renamed;

/// The file with the record of a result.
pub(crate) const RESULT: &str = "result.json";
/// The status of a computation that was interrupted.
pub(crate) const CANCELLED: &str = "cancelled";
/// The end of the name of an interrupted result that has given way.
pub(super) const ENDING: &str = ".interrupted";

/// Whether a name is that of a result that says that it was interrupted.
pub(super) fn is_interrupted(path: &Path) -> bool {
    #[derive(Deserialize)]
    struct State {
        status: String,
    }
    // A symbolic link is no directory.
    let is_directory = fs::symlink_metadata(path).is_ok_and(|found| found.is_dir());
    let text = is_directory.then(|| read_text(&path.join(RESULT)).ok());
    let state = text
        .flatten()
        .and_then(|text| serde_json::from_str(&text).ok());
    state.is_some_and(|State { status }| status == CANCELLED)
}

/// Renames an interrupted result, if there is one of this name: nothing is overwritten or removed.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(super) fn give_way(path: &Path) -> Result<(), OutputError> {
    if !is_interrupted(path) {
        return Ok(());
    }
    let named = |number: usize| {
        let mut name = path.as_os_str().to_owned();
        name.push(ENDING);
        if number > 1 {
            name.push(format!("-{number}"));
        }
        PathBuf::from(name)
    };
    let mut free = (1..)
        .map(named)
        .filter(|path| fs::symlink_metadata(path).is_err());
    let free = free.next().unwrap_or_else(|| named(1));
    renamed(path, &free).map_err(OutputError::at(path))
}

#[cfg(test)]
mod tests {
    use super::super::ResultDir;
    use super::*;

    /// Writes a result of this name with a status and a value.
    fn write(target: &Path, status: &str, value: &str) -> Result<(), OutputError> {
        let directory = ResultDir::create(target)?;
        let record = format!("{{\"status\": \"{status}\"}}");
        fs::write(directory.file(RESULT), record).unwrap();
        fs::write(directory.file("value"), value).unwrap();
        directory.commit().map(drop)
    }

    #[test]
    fn interrupted_results_give_way_and_are_kept() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("out");
        let value = |name: &str| fs::read_to_string(place.path().join(name).join("value")).unwrap();
        write(&target, CANCELLED, "first").unwrap();
        write(&target, CANCELLED, "second").unwrap();
        write(&target, "converged", "third").unwrap();
        let exists = |found| matches!(found, Err(OutputError::Exists { .. }));
        assert!(exists(write(&target, "converged", "fourth")));
        assert_eq!(value("out.interrupted"), "first");
        assert_eq!(value("out.interrupted-2"), "second");
        assert_eq!(value("out"), "third");
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 3);
        // Nothing gives way that is not the directory of a result.
        for other in ["plain", "empty"] {
            let path = place.path().join(other);
            match other {
                "plain" => fs::write(&path, "{\"status\": \"cancelled\"}").unwrap(),
                _ => fs::create_dir(&path).unwrap(),
            }
            assert!(exists(write(&path, "converged", "")), "{other}");
        }
    }
}
