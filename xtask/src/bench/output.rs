//! Writes files, each completely or not at all.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use serde::Serialize;

use crate::outcome::Outcome;

/// Writes `text` to a file in a folder, which is created if it does not exist. An existing file is
/// replaced.
pub fn write(folder: &Path, name: &str, text: &str) -> Outcome<()> {
    let place = folder.join(name);
    let said =
        |error: &dyn std::fmt::Display| format!("cannot write '{}': {error}", place.display());
    fs::create_dir_all(folder).map_err(|e| said(&e))?;
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(|e| said(&e))?;
    file.write_all(text.as_bytes()).map_err(|e| said(&e))?;
    file.persist(&place).map_err(|e| said(&e))?;
    eprintln!("wrote {}", place.display());
    Ok(())
}

/// Writes a value as JSON.
pub fn write_json(folder: &Path, name: &str, value: &impl Serialize) -> Outcome<()> {
    let mut text = serde_json::to_string_pretty(value)?;
    text.push('\n');
    write(folder, name, &text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_nothing_else_is_left_behind() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("new");
        write(&folder, "a.txt", "old").unwrap();
        write_json(&folder, "a.txt", &[1, 2]).unwrap();
        let text = fs::read_to_string(folder.join("a.txt")).unwrap();
        assert_eq!(serde_json::from_str::<Vec<u8>>(&text).unwrap(), [1, 2]);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
    }
}
