//! Folders and patterns as inputs: the readable files that they stand for, in natural order.

use std::cmp::Ordering;
use std::iter::Peekable;
use std::path::{Path, PathBuf};
use std::str::Chars;

use glob::{MatchOptions, glob_with};

use super::endings::is_image;
use super::exact::is_exact;
use super::{InputError, extension_of};
use crate::terminal::{note, printable};

/// Files that are named at most when some are left out.
const NAMED: usize = 4;

/// What the inputs of a command may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kinds {
    /// Masks: images, surfaces and outlines.
    Masks,
    /// Images.
    Images,
}

/// Replaces folders and patterns by their files. Files that are left out are named on standard error.
///
/// # Errors
/// [`InputError::NoInputs`] where there is no readable file, and [`InputError::ResultFolder`] for a
/// result of the program.
pub fn expand(inputs: &mut Vec<PathBuf>, kinds: Kinds) -> Result<(), InputError> {
    let mut files = Vec::new();
    for input in inputs.drain(..) {
        if input.is_dir() {
            files.extend(of_folder(&input, kinds)?);
        } else if !input.exists() && is_pattern(&input) {
            files.extend(of_pattern(&input, kinds)?);
        } else {
            files.push(input);
        }
    }
    *inputs = files;
    Ok(())
}

fn is_pattern(path: &Path) -> bool {
    path.to_string_lossy().contains(['*', '?', '['])
}

fn of_folder(folder: &Path, kinds: Kinds) -> Result<Vec<PathBuf>, InputError> {
    if folder.join("result.json").is_file() {
        return Err(InputError::ResultFolder {
            path: folder.into(),
        });
    }
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let entries = entries.map_err(|source| InputError::Unreadable {
        path: folder.into(),
        source,
    })?;
    let hidden = |path: &Path| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().starts_with('.')
    };
    let paths = entries.into_iter().map(|entry| entry.path());
    readable(folder, paths.filter(|path| !hidden(path)).collect(), kinds)
}

fn of_pattern(pattern: &Path, kinds: Kinds) -> Result<Vec<PathBuf>, InputError> {
    let options = MatchOptions {
        require_literal_leading_dot: true,
        require_literal_separator: true,
        ..MatchOptions::new()
    };
    // A pattern that cannot be read matches nothing.
    let found = glob_with(&pattern.to_string_lossy(), options).ok();
    let paths = found.into_iter().flatten().filter_map(Result::ok);
    readable(pattern, paths.collect(), kinds)
}

/// The readable files of a folder or of a pattern. Tables and headers of data files count only where
/// they do not belong to other files: in folders, tables mostly say something about images.
fn readable(
    whole: &Path,
    mut paths: Vec<PathBuf>,
    kinds: Kinds,
) -> Result<Vec<PathBuf>, InputError> {
    in_order(&mut paths);
    let (mut files, mut others): (Vec<PathBuf>, Vec<PathBuf>) = paths
        .into_iter()
        .partition(|path| path.is_file() && is_readable(path, kinds));
    // The data of a header of the same name are read with it.
    files.retain(|path| !(extension_of(path) == "img" && path.with_extension("hdr").is_file()));
    let is_table = |path: &PathBuf| extension_of(path) == "csv";
    if whole.is_dir() && !files.iter().all(is_table) {
        let (tables, rest) = files.into_iter().partition(is_table);
        files = rest;
        others.extend::<Vec<PathBuf>>(tables);
        in_order(&mut others);
    }
    if files.is_empty() {
        return Err(InputError::NoInputs {
            path: whole.into(),
            others: others.len(),
        });
    }
    if !others.is_empty() {
        let names = others.iter().take(NAMED).map(|path| {
            let name = path.file_name().unwrap_or_default();
            format!("'{}'", name.to_string_lossy())
        });
        let names = names.collect::<Vec<_>>().join(", ");
        let more = match others.len().saturating_sub(NAMED) {
            0 => String::new(),
            more => format!(" and {more} others"),
        };
        let (whole, count) = (whole.display(), files.len());
        note(printable(&format!(
            "'{whole}': {count} files, without {names}{more}, which are no inputs"
        )));
    }
    Ok(files)
}

fn in_order(paths: &mut [PathBuf]) {
    paths.sort_by(|a, b| natural(&a.to_string_lossy(), &b.to_string_lossy()));
}

fn is_readable(path: &Path, kinds: Kinds) -> bool {
    is_image(&path.to_string_lossy()) || kinds == Kinds::Masks && is_exact(&extension_of(path))
}

/// The order in which people count: numbers by their size, letters without their case.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a.chars().peekable(), b.chars().peekable());
    loop {
        let order = match (left.peek(), right.peek()) {
            (None, None) => return a.cmp(b),
            (Some(x), Some(y)) if x.is_ascii_digit() && y.is_ascii_digit() => {
                let (x, y) = (number(&mut left), number(&mut right));
                x.len().cmp(&y.len()).then_with(|| x.cmp(&y))
            }
            _ => {
                let lower = |c: Option<char>| c.map(|c| c.to_lowercase().collect::<String>());
                lower(left.next()).cmp(&lower(right.next()))
            }
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

/// The digits of a number without zeros at its beginning.
fn number(chars: &mut Peekable<Chars<'_>>) -> String {
    let mut digits = String::new();
    while let Some(digit) = chars.next_if(char::is_ascii_digit) {
        if !(digits.is_empty() && digit == '0') {
            digits.push(digit);
        }
    }
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_counted() {
        let mut names = [
            "b2", "a10", "A2", "a1x", "a01", "a", "a2.5", "a2", "10", "9", "a1",
        ];
        names.sort_by(|a, b| natural(a, b));
        let expected = [
            "9", "10", "a", "a01", "a1", "a1x", "A2", "a2", "a2.5", "a10", "b2",
        ];
        assert_eq!(names, expected);
        let large = ["x99999999999999999999999", "x100000000000000000000000"];
        assert_eq!(natural(large[0], large[1]), Ordering::Less);
    }
}
