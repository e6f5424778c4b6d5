//! Archives that are the same bytes for the same files: in the order of their names, without times and
//! owners.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use tar::{Builder, Header};

/// The contents of an archive.
#[derive(Default)]
pub struct Contents(Vec<Entry>);

struct Entry {
    path: PathBuf,
    bytes: Vec<u8>,
    is_program: bool,
}

impl Contents {
    /// Adds a file.
    pub fn add(&mut self, path: impl Into<PathBuf>, bytes: Vec<u8>) {
        self.0.push(Entry {
            path: path.into(),
            bytes,
            is_program: false,
        });
    }

    /// Adds a file that can be run.
    pub fn add_program(&mut self, path: impl Into<PathBuf>, bytes: Vec<u8>) {
        self.add(path, bytes);
        if let Some(entry) = self.0.last_mut() {
            entry.is_program = true;
        }
    }

    /// Adds the files of a folder for which `wanted` holds, and those of its folders.
    ///
    /// # Errors
    /// Those of reading.
    pub fn add_folder(
        &mut self,
        path: &Path,
        folder: &Path,
        wanted: &dyn Fn(&Path) -> bool,
    ) -> io::Result<()> {
        for entry in fs::read_dir(folder)? {
            let from = entry?.path();
            let name = from.file_name().unwrap_or_default();
            if from.is_dir() {
                self.add_folder(&path.join(name), &from, wanted)?;
            } else if wanted(&from) {
                self.add(path.join(name), fs::read(&from)?);
            }
        }
        Ok(())
    }

    /// Writes a compressed archive with all in one folder.
    ///
    /// # Errors
    /// Those of writing.
    pub fn write(mut self, target: &Path, folder: &str) -> io::Result<()> {
        self.0.sort_by(|a, b| a.path.cmp(&b.path));
        let file = GzEncoder::new(File::create(target)?, Compression::best());
        let mut archive = Builder::new(file);
        for entry in &self.0 {
            let mut header = Header::new_gnu();
            header.set_size(entry.bytes.len() as u64);
            header.set_mode(if entry.is_program { 0o755 } else { 0o644 });
            header.set_mtime(0);
            let path = Path::new(folder).join(&entry.path);
            archive.append_data(&mut header, path, entry.bytes.as_slice())?;
        }
        archive.into_inner()?.finish()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_depends_on_its_files_only() {
        let folder = tempfile::tempdir().unwrap();
        let written = |names: [&str; 2]| {
            let mut contents = Contents::default();
            for name in names {
                contents.add_program(name, name.as_bytes().to_vec());
            }
            let target = folder.path().join("archive.tar.gz");
            contents.write(&target, "all").unwrap();
            fs::read(target).unwrap()
        };
        let bytes = written(["a/b", "c"]);
        assert_eq!(bytes, written(["c", "a/b"]));
        let decoded = flate2::read::GzDecoder::new(bytes.as_slice());
        let mut archive = tar::Archive::new(decoded);
        let paths = archive.entries().unwrap().map(|entry| {
            let entry = entry.unwrap();
            assert_eq!(entry.header().mode().unwrap(), 0o755);
            entry.path().unwrap().into_owned()
        });
        let paths: Vec<_> = paths.collect();
        assert_eq!(paths, [Path::new("all/a/b"), Path::new("all/c")]);
    }
}
