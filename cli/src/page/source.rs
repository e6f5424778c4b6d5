//! What a report is made of: an incomplete result directory and the summary of its result.

use std::cell::Cell;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::report::RESULT;
use crate::summary::Summary;

/// Most bytes of pictures and surfaces in a page.
const MOST: usize = 7_500_000;

/// A result, and the room that is left in its page.
pub(super) struct Source<'a> {
    folder: &'a Path,
    pub summary: &'a Summary,
    /// The command line, where there is one.
    pub command_line: Option<&'a str>,
    /// The contents of `result.json`.
    pub record: Value,
    /// All files, by their names.
    pub files: Vec<Listed>,
    room: Cell<usize>,
}

/// A file of a directory.
pub(super) struct Listed {
    /// With slashes.
    pub name: String,
    pub bytes: u64,
}

impl<'a> Source<'a> {
    /// The result in a folder.
    ///
    /// # Errors
    /// Those of reading the folder and the record.
    pub fn read(
        folder: &'a Path,
        summary: &'a Summary,
        command_line: Option<&'a str>,
    ) -> io::Result<Self> {
        let record = serde_json::from_slice(&fs::read(folder.join(RESULT))?)?;
        let mut files = Vec::new();
        list(folder, "", &mut files)?;
        files.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Self {
            folder,
            summary,
            command_line,
            record,
            files,
            room: Cell::new(MOST),
        })
    }

    /// The path of a file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// The contents of a file, if it is there.
    pub fn bytes(&self, name: &str) -> Option<Vec<u8>> {
        fs::read(self.path(name)).ok()
    }

    /// The text of a file, if it is there.
    pub fn text(&self, name: &str) -> Option<String> {
        String::from_utf8(self.bytes(name)?).ok()
    }

    /// Names of the files of the folder itself with this ending, in their order.
    pub fn ending<'s>(&'s self, ending: &'s str) -> impl Iterator<Item = &'s str> + 's {
        let names = self.files.iter().map(|file| file.name.as_str());
        names.filter(move |name| name.ends_with(ending) && !name.contains('/'))
    }

    /// Takes room for letters of a page, if there is enough.
    pub fn take(&self, letters: usize) -> bool {
        let left = self.room.get().checked_sub(letters);
        self.room.set(left.unwrap_or(self.room.get()));
        left.is_some()
    }

    /// The room that is left.
    pub fn room(&self) -> usize {
        self.room.get()
    }
}

/// Lists the files of a folder and of its folders; hidden ones are those of unfinished work.
fn list(folder: &Path, within: &str, files: &mut Vec<Listed>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let own = entry.file_name();
        let own = own.to_string_lossy();
        if own.starts_with('.') {
            continue;
        }
        let name = format!("{within}{own}");
        if entry.file_type()?.is_dir() {
            list(&entry.path(), &format!("{name}/"), files)?;
        } else {
            let bytes = entry.metadata()?.len();
            files.push(Listed { name, bytes });
        }
    }
    Ok(())
}
