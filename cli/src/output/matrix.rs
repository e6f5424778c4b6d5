//! Matrices of pairs and points of objects, as tables and arrays.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::OutputError;
use super::npy::write_array;

/// Writes a matrix with the names of its rows and columns; entries that do not exist are empty.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_matrix_table(
    path: &Path,
    names: &[String],
    entry: impl Fn(usize, usize) -> Option<f64>,
) -> Result<(), OutputError> {
    let mut text = String::new();
    for name in names {
        text.push(',');
        text.push_str(&quoted(name));
    }
    text.push('\n');
    for (i, name) in names.iter().enumerate() {
        text.push_str(&quoted(name));
        for j in 0..names.len() {
            match entry(i, j) {
                // Writing into a string cannot fail.
                Some(value) => drop(write!(text, ",{value:e}")),
                None => text.push(','),
            }
        }
        text.push('\n');
    }
    fs::write(path, text).map_err(OutputError::at(path))
}

/// Writes a square matrix as an array `(n, n)`; entries that do not exist are NaN.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_matrix_array(
    path: &Path,
    n: usize,
    entry: impl Fn(usize, usize) -> Option<f64>,
) -> Result<(), OutputError> {
    let values = (0..n * n).map(|at| entry(at / n, at % n).unwrap_or(f64::NAN));
    write_array(path, &[n, n], values)
}

/// Writes lines of named columns. Text is quoted where it has to be.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_lines(path: &Path, head: &str, lines: &[Vec<String>]) -> Result<(), OutputError> {
    let mut text = format!("{head}\n");
    for line in lines {
        let cells: Vec<String> = line.iter().map(|cell| quoted(cell)).collect();
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    fs::write(path, text).map_err(OutputError::at(path))
}

/// A cell of a table (RFC 4180).
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_entries_are_there() {
        let place = tempfile::tempdir().unwrap();
        let (csv, npy) = (place.path().join("m.csv"), place.path().join("m.npy"));
        let names = ["plain".to_owned(), "a \"b\", c".to_owned()];
        let entry = |i: usize, j: usize| (i + j > 0).then_some((i + 2 * j) as f64 / 4.0);
        write_matrix_table(&csv, &names, entry).unwrap();
        assert_eq!(
            fs::read_to_string(&csv).unwrap(),
            ",plain,\"a \"\"b\"\", c\"\nplain,,5e-1\n\"a \"\"b\"\", c\",2.5e-1,7.5e-1\n"
        );
        write_matrix_array(&npy, 2, entry).unwrap();
        let bytes = fs::read(&npy).unwrap();
        let (header, numbers) = bytes.split_at(128);
        let header = String::from_utf8_lossy(header);
        assert!(header.contains("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2), }"));
        let numbers = numbers.as_chunks().0.iter();
        let values: Vec<f64> = numbers.map(|&b| f64::from_le_bytes(b)).collect();
        assert!(values[0].is_nan());
        assert_eq!(values[1..], [0.5, 0.25, 0.75]);
    }
}
