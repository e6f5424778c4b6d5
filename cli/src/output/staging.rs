//! Temporary names beside a target: locked while they are in use, removed on every way out of the
//! program, and swept by a later run where a process could not do so.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::handle::Handle;

const PREFIX: &str = ".shapespace-";
/// The file in a folder that its process locks.
const LOCK: &str = "lock";

/// The temporary files and folders of this process.
static IN_USE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn in_use() -> MutexGuard<'static, Vec<PathBuf>> {
    // The list is whole after every statement, also after a panic elsewhere.
    IN_USE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary files and folders of this process, before it ends. From then on no result
/// appears under its name: whoever wants to rename one waits until the process has ended.
pub(crate) fn discard_all() {
    let names = in_use();
    for path in names.iter() {
        // Other threads may be writing into it: once more finds what they have added.
        for _ in 0..50 {
            if remove(path).is_ok() {
                break;
            }
        }
    }
    std::mem::forget(names);
}

/// A temporary folder, which is removed with all that is in it when this is dropped.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
    handle: Handle,
    /// Held until the end; `None` if the file system has no locks.
    _lock: Option<File>,
}

impl Folder {
    /// Creates a folder, after sweeping those of dead processes.
    pub fn create_in(parent: &Path) -> io::Result<Self> {
        sweep(parent);
        let folder = tempfile::Builder::new()
            .prefix(&prefix())
            .tempdir_in(parent)?;
        let handle = Handle::open(folder.path())?;
        let lock = File::create_new(handle.path().join(LOCK))?;
        let lock = lock.try_lock().is_ok().then_some(lock);
        let path = folder.keep();
        in_use().push(path.clone());
        Ok(Self {
            path,
            handle,
            _lock: lock,
        })
    }

    /// The path of the folder's handle.
    pub fn path(&self) -> &Path {
        self.handle.path()
    }
}

/// Renames a folder, unless the process is about to end.
pub(super) fn renamed(from: &Path, to: &Path) -> io::Result<()> {
    let _not_ending = in_use();
    fs::rename(from, to)
}

impl Drop for Folder {
    fn drop(&mut self) {
        let mut names = in_use();
        names.retain(|name| *name != self.path);
        // A later run sweeps what cannot be removed now.
        let _ = remove(&self.path);
    }
}

/// Writes a file under a temporary name beside its target, and gives it its name unless that is
/// taken.
pub(super) fn new_file(parent: &Path, target: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = Folder::create_in(parent)?;
    let incomplete = folder.path().join("file");
    fs::write(&incomplete, bytes)?;
    let _not_ending = in_use();
    // A link does not replace an existing name; some file systems have no links.
    match fs::hard_link(&incomplete, target) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
            File::create_new(target)?;
            fs::rename(&incomplete, target)
        }
        linked => linked,
    }
}

/// The names of this process start like this.
fn prefix() -> String {
    format!("{PREFIX}{}-", std::process::id())
}

fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_dir_all(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// Removes the folders that processes have left that did not end in order.
fn sweep(parent: &Path) {
    let Ok(entries) = fs::read_dir(parent) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let owner = name.to_str().and_then(|name| name.strip_prefix(PREFIX));
        let owner = owner.and_then(|rest| rest.split_once('-')?.0.parse::<u32>().ok());
        // The type of the entry itself: a symbolic link is no folder.
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if let Some(owner) = owner
            && is_folder
            && !lives(owner)
        {
            sweep_one(&entry.path());
        }
    }
}

/// Removes a folder whose lock nobody holds; one without a lock only if it is empty.
fn sweep_one(path: &Path) {
    match OpenOptions::new().write(true).open(path.join(LOCK)) {
        Ok(lock) if lock.try_lock().is_ok() => {
            let _ = remove_folder(path, &[LOCK]);
        }
        Ok(_) => {}
        Err(_) => {
            let _ = fs::remove_dir(path);
        }
    }
}

/// Removes a folder with all that is in it: files before folders, and the named ones last, in this order. A
/// process that is killed meanwhile leaves a folder that is still known as what it is.
pub(super) fn remove_folder(name: &Path, last: &[&str]) -> io::Result<()> {
    let handle = Handle::open(name)?;
    let path = handle.path();
    let entries: Vec<_> = fs::read_dir(path)?.collect::<Result<_, _>>()?;
    let mut folders = Vec::new();
    for entry in entries {
        // The type of the entry itself: a symbolic link is no folder.
        if entry.file_type()?.is_dir() {
            folders.push(entry.path());
        } else if !last.iter().any(|name| entry.file_name() == *name) {
            fs::remove_file(entry.path())?;
        }
    }
    for folder in folders {
        fs::remove_dir_all(folder)?;
    }
    for file in last.iter().map(|name| path.join(name)) {
        match fs::remove_file(file) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    fs::remove_dir(name)
}

/// Whether a process of this number lives on this machine, where the system shows it (Linux). The
/// lock decides elsewhere, and for machines that share a file system.
fn lives(process: u32) -> bool {
    Path::new("/proc").join(process.to_string()).exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listing(place: &Path) -> Vec<String> {
        let entries = fs::read_dir(place).unwrap().flatten();
        let mut names: Vec<_> = entries
            .map(|entry| entry.file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn what_dead_processes_left_is_swept_and_nothing_else() {
        let place = tempfile::tempdir().unwrap();
        let path = |name: &str| place.path().join(name);
        // Greater than any number of a process.
        for name in [".shapespace-4194999-left", ".shapespace-4194998-held"] {
            fs::create_dir(path(name)).unwrap();
            fs::write(path(name).join(LOCK), "").unwrap();
        }
        let held = File::open(path(".shapespace-4194998-held").join(LOCK)).unwrap();
        held.lock().unwrap();
        fs::create_dir(path(".shapespace-4194997-empty")).unwrap();
        fs::create_dir(path(".shapespace-4194996-foreign")).unwrap();
        fs::write(path(".shapespace-4194996-foreign").join("a"), "").unwrap();
        fs::create_dir(path(".shapespace-mine")).unwrap();
        fs::write(path(".shapespace-mine").join(LOCK), "").unwrap();
        let own = Folder::create_in(place.path()).unwrap();
        let second = Folder::create_in(place.path()).unwrap();
        assert!(own.path().is_dir());
        drop((own, second));
        assert_eq!(
            listing(place.path()),
            [
                ".shapespace-4194996-foreign",
                ".shapespace-4194998-held",
                ".shapespace-mine"
            ]
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_not_followed() {
        let place = tempfile::tempdir().unwrap();
        let precious = place.path().join("precious");
        fs::create_dir(&precious).unwrap();
        fs::write(precious.join(LOCK), "").unwrap();
        let link = place.path().join(".shapespace-4194999-x");
        std::os::unix::fs::symlink(&precious, &link).unwrap();
        sweep(place.path());
        assert_eq!(listing(place.path()), [".shapespace-4194999-x", "precious"]);
        assert_eq!(listing(&precious), [LOCK]);
    }
}
