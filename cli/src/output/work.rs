//! A result directory that is created over several runs of the program.

use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::directory::{ResultDir, check_target, plain_name};
use super::handle::{Handle, shown};
use super::sealed::{sealed_text, unsealed};
use super::{OutputError, staging};
use shapespace_input::files::read_text;

/// Ending of the name while the directory is not complete.
const ENDING: &str = ".partial";
/// The file that states what the work depends on.
pub(crate) const DESCRIPTION: &str = "work.json";
/// Start of the names of folders of damaged work.
const ASIDE: &str = "damaged_";
/// The file that the current run locks.
const LOCK: &str = ".lock";

/// An incomplete directory that outlives the program: `TARGET.partial`, beside its target. Its
/// files appear under their names only when they are complete, and the directory itself may become
/// the result ([`WorkDir::into_result`]). One run at a time can hold it.
#[derive(Debug)]
pub struct WorkDir {
    target: PathBuf,
    inner: PathBuf,
    handle: Handle,
    /// Held until this is dropped; `None` if the file system has no locks.
    lock: Option<File>,
}

impl WorkDir {
    /// Creates a directory, or opens an existing one.
    ///
    /// # Errors
    /// [`OutputError::Exists`] for the target itself, [`OutputError::NoParent`],
    /// [`OutputError::Busy`] where another run holds it, [`OutputError::Link`] for symbolic links,
    /// [`OutputError::Unwritable`].
    pub fn open(target: &Path) -> Result<Self, OutputError> {
        let (_, target) = check_target(target)?;
        let inner = partial(&target);
        if fs::symlink_metadata(&inner).is_err() {
            fs::create_dir(&inner).map_err(OutputError::at(&inner))?;
        }
        let kind = fs::symlink_metadata(&inner).map_err(OutputError::at(&inner))?;
        if kind.file_type().is_symlink() {
            return Err(OutputError::Link { path: inner });
        }
        let handle = Handle::open(&inner).map_err(OutputError::at(&inner))?;
        check_links(&handle.path().join("."))?;
        let file = handle.path().join(LOCK);
        let mut options = OpenOptions::new();
        let file = options
            .create(true)
            .truncate(false)
            .write(true)
            .open(&file)
            .map_err(OutputError::at(&file))?;
        let lock = match file.try_lock() {
            Ok(()) => Some(file),
            Err(TryLockError::WouldBlock) => return Err(OutputError::Busy { path: inner }),
            Err(TryLockError::Error(_)) => None,
        };
        // Again, for what another run has put there before it let go.
        check_links(&handle.path().join("."))?;
        Ok(Self {
            target,
            inner,
            handle,
            lock,
        })
    }

    /// Its path while it is incomplete.
    pub fn path(&self) -> &Path {
        &self.inner
    }

    /// The path of a file in it, by the handle of the folder.
    pub fn file(&self, name: impl AsRef<Path>) -> PathBuf {
        self.handle.path().join(name)
    }

    /// Creates a folder in it, unless it exists.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn folder(&self, name: &str) -> Result<(), OutputError> {
        let path = self.file(name);
        fs::create_dir_all(&path).map_err(OutputError::at(&path))
    }

    /// Writes a value as JSON with its checksum, and replaces an existing file.
    ///
    /// # Errors
    /// [`OutputError::NotFinite`], [`OutputError::Unwritable`].
    pub fn put(&self, name: impl AsRef<Path>, value: &impl Serialize) -> Result<(), OutputError> {
        let path = self.file(name);
        let mut incomplete = path.clone().into_os_string();
        incomplete.push(ENDING);
        let incomplete = PathBuf::from(incomplete);
        let text = sealed_text(&incomplete, value)?;
        fs::write(&incomplete, text).map_err(OutputError::at(&incomplete))?;
        // Else a power failure may leave the name without the contents.
        sync(&incomplete)?;
        fs::rename(&incomplete, &path).map_err(OutputError::at(&path))?;
        sync(&self.file("."))
    }

    /// Moves all that is in it, except for its description, into a new folder in it.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`].
    pub fn set_aside(&self) -> Result<PathBuf, OutputError> {
        let failed = OutputError::at(&self.inner);
        let entries = fs::read_dir(self.handle.path()).map_err(&failed)?;
        let names: Vec<_> = entries.flatten().map(|entry| entry.file_name()).collect();
        let free = (0..).map(|k| self.file(format!("{ASIDE}{k:03}")));
        let aside = free.into_iter().find(|path| !path.exists());
        let aside = aside.unwrap_or_else(|| self.file(ASIDE));
        fs::create_dir(&aside).map_err(&failed)?;
        for name in names {
            let text = name.to_string_lossy();
            if text != LOCK && text != DESCRIPTION && !text.starts_with(ASIDE) {
                fs::rename(self.file(&name), aside.join(&name)).map_err(&failed)?;
            }
        }
        Ok(shown(&aside))
    }

    /// A value that was written as JSON; none where there is no such file, or where it holds
    /// something else than was written, as a file may after a power failure.
    pub fn get<T: DeserializeOwned>(&self, name: impl AsRef<Path>) -> Option<T> {
        unsealed(&read_text(&self.file(name)).ok()?)
    }

    /// Whether nothing has been written in it yet: a run may have been killed before its description was
    /// complete.
    pub fn is_new(&self) -> bool {
        let incomplete = format!("{DESCRIPTION}{ENDING}");
        let is_nothing = |name: &OsStr| name == LOCK || name == &*incomplete;
        fs::read_dir(self.handle.path())
            .is_ok_and(|entries| entries.flatten().all(|e| is_nothing(&e.file_name())))
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
        let removed = staging::remove_folder(&self.inner, &[DESCRIPTION, LOCK]);
        let removed = removed.map_err(OutputError::at(&self.inner));
        drop(self.lock);
        removed
    }

    /// The result directory with all that is in it.
    pub fn into_result(self) -> ResultDir {
        ResultDir::of_work(self.target, self.inner, self.handle, LOCK, self.lock)
    }
}

/// Waits until a file or a folder is on the disk.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn sync(path: &Path) -> Result<(), OutputError> {
    // Folders cannot be opened everywhere.
    if cfg!(unix) || path.is_file() {
        let file = File::open(path).map_err(OutputError::at(path))?;
        file.sync_all().map_err(OutputError::at(path))?;
    }
    Ok(())
}

/// Rejects a folder that is, or holds, a symbolic link: what is written or removed there would be
/// elsewhere. Entries that another run removes meanwhile are none.
fn check_links(path: &Path) -> Result<(), OutputError> {
    let failed = OutputError::at(path);
    let kind = match fs::symlink_metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        found => found.map_err(&failed)?.file_type(),
    };
    if kind.is_symlink() {
        return Err(OutputError::Link { path: shown(path) });
    }
    if kind.is_dir() {
        let entries = match fs::read_dir(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            found => found.map_err(&failed)?,
        };
        for entry in entries {
            check_links(&entry.map_err(&failed)?.path())?;
        }
    }
    Ok(())
}

fn partial(target: &Path) -> PathBuf {
    let mut name = plain_name(target).into_os_string();
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
        fs::write(first.file("work.json.partial"), "{").unwrap();
        assert!(first.is_new());
        first.put(DESCRIPTION, &1.5).unwrap();
        assert!(!first.is_new());
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
        assert_eq!(names.len(), 2, "{names:?}");
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

    #[cfg(unix)]
    #[test]
    fn symbolic_links_are_refused_and_what_they_name_is_kept() {
        use std::os::unix::fs::symlink;
        let place = tempfile::tempdir().unwrap();
        let precious = place.path().join("precious");
        fs::create_dir(&precious).unwrap();
        fs::write(precious.join("a"), "kept").unwrap();
        let refused = |link: &str, to: &Path| {
            let target = place.path().join("out");
            fs::create_dir(place.path().join("out.partial")).ok();
            symlink(to, place.path().join(link)).unwrap();
            let error = WorkDir::open(&target).unwrap_err();
            assert!(matches!(error, OutputError::Link { .. }), "{error}");
            fs::remove_file(place.path().join(link)).unwrap();
            assert_eq!(fs::read_to_string(precious.join("a")).unwrap(), "kept");
        };
        refused("out.partial/.lock", &precious.join("a"));
        refused("out.partial/state.json.partial", &precious.join("a"));
        refused("out.partial/deformations_000", &precious);
        fs::remove_dir(place.path().join("out.partial")).unwrap();
        symlink(&precious, place.path().join("out.partial")).unwrap();
        let error = WorkDir::open(&place.path().join("out")).unwrap_err();
        assert!(matches!(error, OutputError::Link { .. }), "{error}");
        assert_eq!(fs::read_dir(&precious).unwrap().count(), 1);
    }

    /// A run that holds the directory writes and removes in it while others ask for it.
    #[test]
    fn who_asks_for_a_busy_directory_hears_that_it_is_busy() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("out");
        let held = WorkDir::open(&target).unwrap();
        let done = std::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !done.load(std::sync::atomic::Ordering::Relaxed) {
                    for k in 0..8 {
                        held.folder(&format!("checkpoint_{k}")).unwrap();
                    }
                    for k in 0..8 {
                        fs::remove_dir(held.file(format!("checkpoint_{k}"))).unwrap();
                    }
                }
            });
            let busy = |_: &i32| matches!(WorkDir::open(&target), Err(OutputError::Busy { .. }));
            let heard = (0..2000).filter(busy).count();
            done.store(true, std::sync::atomic::Ordering::Relaxed);
            assert_eq!(heard, 2000);
        });
    }

    /// `OUT.partial` is replaced by a link while it is in use.
    #[cfg(target_os = "linux")]
    #[test]
    fn nothing_is_written_or_removed_where_a_link_leads() {
        let place = tempfile::tempdir().unwrap();
        let precious = place.path().join("precious");
        fs::create_dir_all(precious.join("folder")).unwrap();
        fs::write(precious.join("a"), "kept").unwrap();
        let work = WorkDir::open(&place.path().join("out")).unwrap();
        let name = place.path().join("out.partial");
        fs::rename(&name, place.path().join("stolen")).unwrap();
        std::os::unix::fs::symlink(&precious, &name).unwrap();
        work.put("a", &1.5).unwrap();
        work.folder("more").unwrap();
        assert!(place.path().join("stolen/more").is_dir());
        work.set_aside().unwrap();
        assert!(work.remove().is_err());
        assert_eq!(fs::read_to_string(precious.join("a")).unwrap(), "kept");
        assert_eq!(fs::read_dir(&precious).unwrap().count(), 2);
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
