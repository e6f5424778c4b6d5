//! Folders that are opened once, and used by their handle.
//!
//! Where a folder is replaced by a symbolic link while it is in use, what is written by its name would be
//! written elsewhere. Linux has names for open folders, `/proc/self/fd/N`, which stay with the folder; other
//! systems use its own name.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Where the names of open files are.
const OPEN: &str = "/proc/self/fd";

/// An open folder.
#[derive(Debug)]
pub(super) struct Handle {
    path: PathBuf,
    /// The folder, open for as long as its path is in use.
    _folder: Option<File>,
}

impl Handle {
    /// Opens a folder.
    ///
    /// # Errors
    /// Those of the system, and one for a symbolic link.
    pub fn open(folder: &Path) -> io::Result<Self> {
        Ok(Self::by_handle(folder)?.unwrap_or_else(|| Self {
            path: folder.into(),
            _folder: None,
        }))
    }

    /// `None` where open folders have no names.
    #[cfg(target_os = "linux")]
    fn by_handle(folder: &Path) -> io::Result<Option<Self>> {
        use std::fs::{metadata, symlink_metadata};
        use std::os::fd::AsRawFd;
        use std::os::unix::fs::MetadataExt;
        let file = File::open(folder)?;
        let (own, there) = (file.metadata()?, symlink_metadata(folder)?);
        let is_same = |other: &std::fs::Metadata| {
            other.is_dir() && (own.dev(), own.ino()) == (other.dev(), other.ino())
        };
        if !is_same(&there) {
            let what = "it is a symbolic link, or has been replaced by one";
            return Err(io::Error::new(io::ErrorKind::NotADirectory, what));
        }
        let path = Path::new(OPEN).join(file.as_raw_fd().to_string());
        let is_named = metadata(&path).is_ok_and(|named| is_same(&named));
        Ok(is_named.then_some(Self {
            path,
            _folder: Some(file),
        }))
    }

    #[cfg(not(target_os = "linux"))]
    fn by_handle(_folder: &Path) -> io::Result<Option<Self>> {
        Ok(None)
    }

    /// The path of the folder, or of the handle.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// A path for the user: that of a handle by the name of its folder.
pub(super) fn shown(path: &Path) -> PathBuf {
    let Ok(inside) = path.strip_prefix(OPEN) else {
        return path.into();
    };
    let mut parts = inside.components();
    let open = parts.next().map(|number| Path::new(OPEN).join(number));
    match open.and_then(|open| std::fs::read_link(open).ok()) {
        Some(folder) => folder.join(parts.as_path()),
        None => path.into(),
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_os = "linux")]
    #[test]
    fn a_folder_that_is_replaced_is_used_still() {
        use super::*;
        use std::fs;
        use std::os::unix::fs::symlink;
        let place = tempfile::tempdir().unwrap();
        let (folder, moved) = (place.path().join("folder"), place.path().join("moved"));
        let precious = place.path().join("precious");
        fs::create_dir(&folder).unwrap();
        fs::create_dir(&precious).unwrap();
        let handle = Handle::open(&folder).unwrap();
        assert_eq!(shown(&handle.path().join("a/b")), folder.join("a/b"));
        fs::rename(&folder, &moved).unwrap();
        symlink(&precious, &folder).unwrap();
        fs::write(handle.path().join("a"), "x").unwrap();
        assert!(moved.join("a").is_file());
        assert_eq!(fs::read_dir(&precious).unwrap().count(), 0);
        assert!(Handle::open(&folder).is_err());
        assert_eq!(shown(&precious), precious);
    }
}
