//! Result directories and files that appear under their names only when they are complete, and
//! results in memory.

use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use fe_grid::parallel;
use shapespace_picture::Canvas;

use super::OutputError;
use super::handle::Handle;
use super::interrupted::{ENDING, give_way, is_interrupted};
use super::kept::Kept;
use super::staging::{Folder, new_file, renamed};

/// An incomplete result directory: a hidden sibling of its target, which is removed unless
/// [`ResultDir::commit`] renames it; or a [`WorkDir`](super::WorkDir), which remains; or a result in
/// memory, which has the arrays and the record of the directory, and no other files.
#[derive(Debug)]
pub struct ResultDir {
    target: PathBuf,
    inner: PathBuf,
    origin: Origin,
    /// Whether there are other files than arrays and the record.
    drawn: bool,
}

/// How an incomplete directory was created.
#[derive(Debug)]
enum Origin {
    /// Within a temporary directory.
    Temporary(Folder),
    /// Over several runs, with the name of its lock, which is held if the file system has locks.
    Work(Handle, &'static str, Option<File>),
    /// In memory.
    Memory(Mutex<Kept>),
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
        let (parent, target) = check_target(target)?;
        let staging = Folder::create_in(&parent).map_err(OutputError::at(&target))?;
        // The temporary directory itself is private; one created inside has the usual permissions.
        let inner = staging.path().join("result");
        fs::create_dir(&inner).map_err(OutputError::at(&target))?;
        Ok(Self {
            target,
            inner,
            origin: Origin::Temporary(staging),
            drawn: true,
        })
    }

    /// A directory that was created over several runs.
    pub(super) fn of_work(
        target: PathBuf,
        inner: PathBuf,
        handle: Handle,
        lock: &'static str,
        held: Option<File>,
    ) -> Self {
        let origin = Origin::Work(handle, lock, held);
        Self {
            target,
            inner,
            origin,
            drawn: true,
        }
    }

    /// A result in memory.
    pub(crate) fn in_memory() -> Self {
        Self {
            target: PathBuf::new(),
            inner: PathBuf::new(),
            origin: Origin::Memory(Mutex::default()),
            drawn: false,
        }
    }

    /// Where the arrays and the record of a result in memory are kept.
    pub(super) fn kept(&self) -> Option<MutexGuard<'_, Kept>> {
        match &self.origin {
            Origin::Memory(kept) => Some(kept.lock().unwrap_or_else(PoisonError::into_inner)),
            _ => None,
        }
    }

    /// Writes something for each item: files side by side, and arrays in memory one after the other, as they keep
    /// their order.
    ///
    /// # Errors
    /// The first failure in the order of the items.
    pub(crate) fn for_each<I: Send, E: Send>(
        &self,
        items: impl IntoIterator<Item = I>,
        write: &(dyn Fn(I) -> Result<(), E> + Sync),
    ) -> Result<(), E> {
        match self.origin {
            Origin::Memory(_) => items.into_iter().try_for_each(write),
            _ => parallel::try_map(items, write).map(drop),
        }
    }

    /// The arrays and the record of a result in memory.
    pub(crate) fn into_kept(self) -> Kept {
        match self.origin {
            Origin::Memory(kept) => kept.into_inner().unwrap_or_else(PoisonError::into_inner),
            _ => Kept::default(),
        }
    }

    /// The same without all files but the arrays and the record.
    pub(crate) fn without_pictures(mut self) -> Self {
        self.drawn = false;
        self
    }

    /// Whether there are other files than the arrays and the record.
    pub(crate) fn has_files(&self) -> bool {
        self.drawn
    }

    /// Writes a file that is neither an array nor the record, unless the result does without.
    ///
    /// # Errors
    /// Those of writing it.
    pub(crate) fn with_file<E>(
        &self,
        name: impl AsRef<Path>,
        write: impl FnOnce(&Path) -> Result<(), E>,
    ) -> Result<(), E> {
        if self.has_files() {
            write(&self.file(name))
        } else {
            Ok(())
        }
    }

    /// Writes a picture, which is drawn only if the directory has files.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub(crate) fn picture(
        &self,
        name: impl AsRef<Path>,
        draw: impl FnOnce() -> Canvas,
    ) -> Result<(), OutputError> {
        self.with_file(name, |path| {
            draw().write_png(path).map_err(OutputError::at(path))
        })
    }

    /// The path of a file of the directory.
    pub fn file(&self, name: impl AsRef<Path>) -> PathBuf {
        self.path().join(name)
    }

    /// The incomplete directory, by a handle.
    pub fn path(&self) -> &Path {
        match &self.origin {
            Origin::Work(handle, ..) => handle.path(),
            _ => &self.inner,
        }
    }

    /// Renames the directory to its target, from which an interrupted result gives way.
    ///
    /// # Errors
    /// [`OutputError::Exists`] where the name has been taken in the meantime,
    /// [`OutputError::Unwritable`].
    pub fn commit(self) -> Result<PathBuf, OutputError> {
        check_target(&self.target)?;
        let failed = |error: std::io::Error| match error.kind() {
            // Another process was faster.
            ErrorKind::AlreadyExists | ErrorKind::DirectoryNotEmpty | ErrorKind::NotADirectory => {
                OutputError::Exists {
                    path: self.target.clone(),
                }
            }
            _ => OutputError::at(&self.target)(error),
        };
        let placed = || {
            give_way(&self.target)?;
            renamed(&self.inner, &self.target).map_err(failed)
        };
        match self.origin {
            Origin::Temporary(staging) => {
                placed()?;
                drop(staging);
            }
            Origin::Work(handle, lock, held) => {
                placed()?;
                // Held until now, so that no other run begins to use the directory.
                let lock = handle.path().join(lock);
                fs::remove_file(&lock).map_err(OutputError::at(&lock))?;
                drop(held);
            }
            Origin::Memory(_) => {}
        }
        Ok(self.target)
    }
}

/// Writes a file that must not exist.
///
/// # Errors
/// [`OutputError::Exists`], [`OutputError::NoParent`], [`OutputError::Unwritable`].
pub fn write_new_file(target: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let (parent, target) = check_target(target)?;
    new_file(&parent, &target, bytes).map_err(|error| {
        if error.kind() == ErrorKind::AlreadyExists {
            OutputError::Exists {
                path: target.clone(),
            }
        } else {
            OutputError::at(&target)(error)
        }
    })
}

/// The folder of a target, and the target without a slash or a dot at its end. Interrupted results give way to those of
/// the same name.
pub(super) fn check_target(target: &Path) -> Result<(PathBuf, PathBuf), OutputError> {
    let plain = plain_name(target);
    // Names that are too long, also of what stands beside it meanwhile, are told before anything is computed.
    let mut longest = plain.clone().into_os_string();
    longest.push(ENDING);
    if let Err(error) = fs::symlink_metadata(&longest)
        && error.kind() == ErrorKind::InvalidFilename
    {
        return Err(OutputError::at(target)(error));
    }
    let is_taken = fs::symlink_metadata(&plain).is_ok() && !is_interrupted(&plain);
    if plain.file_name().is_none() || is_taken {
        return Err(OutputError::Exists {
            path: target.into(),
        });
    }
    let parent = match plain.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if parent.is_dir() {
        Ok((parent.into(), plain))
    } else {
        Err(OutputError::NoParent {
            path: parent.into(),
        })
    }
}

/// A name without a slash or a dot at its end.
pub(super) fn plain_name(target: &Path) -> PathBuf {
    target.components().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The folder of a result is replaced by a link while it is written.
    #[cfg(target_os = "linux")]
    #[test]
    fn nothing_is_written_where_a_link_leads() {
        let place = tempfile::tempdir().unwrap();
        let precious = place.path().join("precious");
        fs::create_dir(&precious).unwrap();
        fs::write(precious.join("a"), "kept").unwrap();
        let directory = ResultDir::create(&place.path().join("out")).unwrap();
        let hidden = |entry: &fs::DirEntry| entry.file_name().as_encoded_bytes()[0] == b'.';
        let entries = fs::read_dir(place.path()).unwrap().flatten();
        let staging = entries.map(|e| hidden(&e).then(|| e.path()));
        let staging = staging.flatten().next().unwrap();
        fs::rename(&staging, place.path().join("stolen")).unwrap();
        std::os::unix::fs::symlink(&precious, &staging).unwrap();
        fs::create_dir(precious.join("result")).unwrap();
        fs::write(directory.file("a"), "new").unwrap();
        assert_eq!(fs::read_to_string(precious.join("a")).unwrap(), "kept");
        let target = directory.commit().unwrap();
        assert_eq!(fs::read_to_string(target.join("a")).unwrap(), "new");
        assert_eq!(fs::read_dir(precious.join("result")).unwrap().count(), 0);
        assert!(precious.join("a").is_file());
    }

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
    fn a_dot_or_a_slash_may_end_a_name() {
        let place = tempfile::tempdir().unwrap();
        for (given, name) in [("a/.", "a"), ("b/", "b"), ("./c/./", "c")] {
            let kept = ResultDir::create(&place.path().join(given)).unwrap();
            kept.commit().unwrap();
            assert!(place.path().join(name).is_dir(), "{given}");
        }
        for given in ["..", "a/..", "/", "."] {
            assert!(matches!(
                ResultDir::create(&place.path().join(given)),
                Err(OutputError::Exists { .. })
            ));
        }
    }

    #[test]
    fn the_second_of_two_with_one_name_is_refused() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("out");
        let [first, second] = [0, 1].map(|_| ResultDir::create(&target).unwrap());
        for directory in [&first, &second] {
            fs::write(directory.file("whole"), "x").unwrap();
        }
        first.commit().unwrap();
        assert!(matches!(second.commit(), Err(OutputError::Exists { .. })));
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
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
