//! Result directories and files that appear under their names only when they are complete.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::OutputError;

/// An incomplete result directory: a hidden sibling of its target, which is removed unless
/// [`ResultDir::commit`] renames it; or a [`WorkDir`](super::WorkDir), which remains.
#[derive(Debug)]
pub struct ResultDir {
    target: PathBuf,
    inner: PathBuf,
    origin: Origin,
}

/// How an incomplete directory was created.
#[derive(Debug)]
enum Origin {
    /// Within a temporary directory.
    Temporary(TempDir),
    /// Over several runs, with the name of its lock, which is held if the file system has locks.
    Work(PathBuf, Option<File>),
}

impl ResultDir {
    /// Checks that a directory of this name can be created.
    ///
    /// # Errors
    /// [`OutputError::Exists`], [`OutputError::NoParent`].
    pub fn check(target: &Path) -> Result<(), OutputError> {
        check_target(target).map(drop)
    }

    /// Creates an incomplete directory.
    ///
    /// # Errors
    /// [`OutputError::Exists`], [`OutputError::NoParent`], [`OutputError::Unwritable`].
    pub fn create(target: &Path) -> Result<Self, OutputError> {
        let parent = check_target(target)?;
        let staging = tempfile::Builder::new()
            .prefix(".shapespace-")
            .tempdir_in(&parent)
            .map_err(OutputError::at(target))?;
        // The temporary directory itself is private; one created inside has the usual permissions.
        let inner = staging.path().join("result");
        fs::create_dir(&inner).map_err(OutputError::at(target))?;
        Ok(Self {
            target: target.into(),
            inner,
            origin: Origin::Temporary(staging),
        })
    }

    /// A directory that was created over several runs.
    pub(super) fn of_work(target: PathBuf, inner: PathBuf, lock: &str, held: Option<File>) -> Self {
        let origin = Origin::Work(inner.join(lock), held);
        Self {
            target,
            inner,
            origin,
        }
    }

    /// The path of a file of the directory.
    pub fn file(&self, name: impl AsRef<Path>) -> PathBuf {
        self.inner.join(name)
    }

    /// The incomplete directory.
    pub fn path(&self) -> &Path {
        &self.inner
    }

    /// Renames the directory to its target.
    ///
    /// # Errors
    /// [`OutputError::Exists`] where the name has been taken in the meantime,
    /// [`OutputError::Unwritable`].
    pub fn commit(self) -> Result<PathBuf, OutputError> {
        check_target(&self.target)?;
        let failed = OutputError::at(&self.target);
        let mut temporary = None;
        match self.origin {
            Origin::Temporary(staging) => temporary = Some(staging),
            Origin::Work(lock, held) => {
                drop(held);
                fs::remove_file(&lock).map_err(OutputError::at(&lock))?;
            }
        }
        fs::rename(&self.inner, &self.target).map_err(&failed)?;
        if let Some(staging) = temporary {
            staging.close().map_err(&failed)?;
        }
        Ok(self.target)
    }
}

/// Writes a file that must not exist.
///
/// # Errors
/// [`OutputError::Exists`], [`OutputError::NoParent`], [`OutputError::Unwritable`].
pub fn write_new_file(target: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let parent = check_target(target)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".shapespace-");
    // Temporary files are private; this one becomes a usual file, which the system's mask narrows.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder
        .tempfile_in(&parent)
        .map_err(OutputError::at(target))?;
    file.write_all(bytes).map_err(OutputError::at(target))?;
    file.persist_noclobber(target).map_err(|failure| {
        if failure.error.kind() == std::io::ErrorKind::AlreadyExists {
            OutputError::Exists {
                path: target.into(),
            }
        } else {
            OutputError::at(target)(failure.error)
        }
    })?;
    Ok(())
}

/// The folder of a target.
pub(super) fn check_target(target: &Path) -> Result<PathBuf, OutputError> {
    if fs::symlink_metadata(target).is_ok() {
        return Err(OutputError::Exists {
            path: target.into(),
        });
    }
    let parent = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if parent.is_dir() {
        Ok(parent.into())
    } else {
        Err(OutputError::NoParent {
            path: parent.into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_appears_complete_or_not_at_all() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("out");
        let dropped = ResultDir::create(&target).unwrap();
        fs::write(dropped.file("half"), "x").unwrap();
        assert!(!target.exists());
        drop(dropped);
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);

        let kept = ResultDir::create(&target).unwrap();
        fs::write(kept.file("whole"), "x").unwrap();
        assert_eq!(kept.commit().unwrap(), target);
        assert_eq!(fs::read_to_string(target.join("whole")).unwrap(), "x");
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
        assert!(matches!(
            ResultDir::create(&target),
            Err(OutputError::Exists { .. })
        ));
        assert!(matches!(
            ResultDir::create(&place.path().join("no/where")),
            Err(OutputError::NoParent { .. })
        ));
    }

    #[test]
    fn a_file_is_never_overwritten() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("a.bin");
        write_new_file(&target, b"one").unwrap();
        assert!(matches!(
            write_new_file(&target, b"two"),
            Err(OutputError::Exists { .. })
        ));
        assert_eq!(fs::read(&target).unwrap(), b"one");
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
    }
}
