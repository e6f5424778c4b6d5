//! A result directory that is created over several runs of the program.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::directory::{ResultDir, check_target};
use super::{OutputError, write_json};

/// Ending of the name while the directory is not complete.
const ENDING: &str = ".partial";
/// The file that the current run locks.
const LOCK: &str = ".lock";

/// An incomplete directory that outlives the program: `TARGET.partial`, beside its target. Its
/// files appear under their names only when they are complete, and the directory itself may become
/// the result ([`WorkDir::into_result`]). One run at a time can hold it.
#[derive(Debug)]
pub struct WorkDir {
    target: PathBuf,
    inner: PathBuf,
    /// Held until this is dropped; `None` if the file system has no locks.
    lock: Option<File>,
}

impl WorkDir {
    /// Creates a directory, or opens an existing one.
    ///
    /// # Errors
    /// [`OutputError::Exists`] for the target itself, [`OutputError::NoParent`],
    /// [`OutputError::Busy`] where another run holds it, [`OutputError::Unwritable`].
    pub fn open(target: &Path) -> Result<Self, OutputError> {
        check_target(target)?;
        let inner = partial(target);
        if !inner.is_dir() {
            fs::create_dir(&inner).map_err(OutputError::at(&inner))?;
        }
        let file = inner.join(LOCK);
        let file = File::create(&file).map_err(OutputError::at(&file))?;
        let lock = match file.try_lock() {
            Ok(()) => Some(file),
            Err(TryLockError::WouldBlock) => return Err(OutputError::Busy { path: inner }),
            Err(TryLockError::Error(_)) => None,
        };
        Ok(Self {
            target: target.into(),
            inner,
            lock,
        })
    }

    /// Its path while it is incomplete.
    pub fn path(&self) -> &Path {
        &self.inner
    }

    /// The path of a file in it.
    pub fn file(&self, name: impl AsRef<Path>) -> PathBuf {
        self.inner.join(name)
    }

    /// Creates a folder in it, unless it exists.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn folder(&self, name: &str) -> Result<(), OutputError> {
        let path = self.file(name);
        fs::create_dir_all(&path).map_err(OutputError::at(&path))
    }

    /// Writes a value as JSON, and replaces an existing file.
    ///
    /// # Errors
    /// As [`write_json`].
    pub fn put(&self, name: impl AsRef<Path>, value: &impl Serialize) -> Result<(), OutputError> {
        let path = self.file(name);
        let mut incomplete = path.clone().into_os_string();
        incomplete.push(ENDING);
        let incomplete = PathBuf::from(incomplete);
        write_json(&incomplete, value)?;
        fs::rename(&incomplete, &path).map_err(OutputError::at(&path))
    }

    /// A value that was written as JSON; none where there is no such file, or where it holds
    /// something else, as a file may after a power failure.
    pub fn get<T: DeserializeOwned>(&self, name: impl AsRef<Path>) -> Option<T> {
        let bytes = fs::read(self.file(name)).ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Whether nothing has been written in it yet.
    pub fn is_new(&self) -> bool {
        fs::read_dir(&self.inner)
            .is_ok_and(|entries| entries.flatten().all(|entry| entry.file_name() == LOCK))
    }

    /// Whether one exists for a target.
    pub fn exists(target: &Path) -> bool {
        partial(target).is_dir()
    }

    /// Removes the directory and all that is in it.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn remove(self) -> Result<(), OutputError> {
        drop(self.lock);
        fs::remove_dir_all(&self.inner).map_err(OutputError::at(&self.inner))
    }

    /// The result directory with all that is in it.
    pub fn into_result(self) -> ResultDir {
        ResultDir::of_work(self.target, self.inner, LOCK, self.lock)
    }
}

fn partial(target: &Path) -> PathBuf {
    let mut name = target.as_os_str().to_owned();
    name.push(ENDING);
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_is_opened_again_and_renamed_in_the_end() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("out");
        let first = WorkDir::open(&target).unwrap();
        assert!(first.is_new());
        assert!(matches!(
            WorkDir::open(&target),
            Err(OutputError::Busy { .. })
        ));
        first.folder("parts").unwrap();
        first.put("parts/a.json", &[1.5, 2.5]).unwrap();
        assert!(!first.is_new());
        drop(first);
        assert!(!target.exists());
        let second = WorkDir::open(&target).unwrap();
        assert_eq!(second.get("parts/a.json"), Some([1.5, 2.5]));
        assert_eq!(second.get::<f64>("parts/a.json"), None);
        assert_eq!(second.get::<f64>("parts/b.json"), None);
        assert!(WorkDir::exists(&target));
        assert_eq!(second.into_result().commit().unwrap(), target);
        let names: Vec<_> = fs::read_dir(place.path()).unwrap().collect();
        assert_eq!(names.len(), 1);
        let names: Vec<_> = fs::read_dir(&target).unwrap().collect();
        assert_eq!(names.len(), 1, "{names:?}");
        assert!(matches!(
            WorkDir::open(&target),
            Err(OutputError::Exists { .. })
        ));
    }

    #[test]
    fn a_directory_is_removed_with_all_that_is_in_it() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("out");
        let work = WorkDir::open(&target).unwrap();
        work.folder("parts").unwrap();
        work.put("parts/a.json", &1.5).unwrap();
        work.remove().unwrap();
        assert!(!WorkDir::exists(&target));
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
    }

    #[test]
    fn its_folder_has_to_exist() {
        let place = tempfile::tempdir().unwrap();
        assert!(matches!(
            WorkDir::open(&place.path().join("no/where")),
            Err(OutputError::NoParent { .. })
        ));
    }
}
