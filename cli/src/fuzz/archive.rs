//! Several files in one sequence of bytes: each after a line `-- NAME --`.

use std::fs;
use std::io;
use std::path::{Component, Path};

/// No more files than this.
const MOST: usize = 64;

/// Writes the files of an archive into a folder; names that are not inside it are left out.
///
/// # Errors
/// Those of the system.
pub(super) fn unpack(bytes: &[u8], folder: &Path) -> io::Result<()> {
    for (name, contents) in parts(bytes).into_iter().take(MOST) {
        let path = Path::new(name);
        let mut components = path.components();
        if name.is_empty() || !components.all(|part| matches!(part, Component::Normal(_))) {
            continue;
        }
        let path = folder.join(path);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::write(path, contents)?;
    }
    Ok(())
}

/// Names and contents. What comes before the first line of a name is left out, and so is the end of the
/// line before each name.
fn parts(bytes: &[u8]) -> Vec<(&str, &[u8])> {
    let mut found: Vec<(&str, usize, usize)> = Vec::new();
    let mut start = 0;
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        let end = start + line.len();
        let name = line
            .strip_prefix(b"-- ")
            .and_then(|rest| rest.strip_suffix(b" --\n"))
            .and_then(|name| std::str::from_utf8(name).ok());
        if let Some(name) = name {
            found.push((name, start, end));
        }
        start = end;
    }
    let ends = found.iter().skip(1).map(|(_, start, _)| start - 1);
    let ends: Vec<usize> = ends.chain([bytes.len()]).collect();
    let all = found.iter().zip(ends);
    all.map(|((name, _, begin), end)| (*name, bytes.get(*begin..end).unwrap_or_default()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_has_its_files_and_none_elsewhere() {
        let bytes = b"head\n-- a.txt --\none\ntwo\n-- b/c --\n\x00\xff\n-- ../d --\nx\n-- e --\n";
        let expected: [(&str, &[u8]); 4] = [
            ("a.txt", b"one\ntwo"),
            ("b/c", b"\x00\xff"),
            ("../d", b"x"),
            ("e", b""),
        ];
        assert_eq!(parts(bytes), expected);
        let place = tempfile::tempdir().unwrap();
        let inside = place.path().join("inside");
        unpack(bytes, &inside).unwrap();
        assert_eq!(fs::read(inside.join("b/c")).unwrap(), b"\x00\xff");
        assert!(!place.path().join("d").exists());
    }
}
