//! Matrices of pairs and points of objects, as tables and arrays.

use std::path::Path;

use shapespace_report::table::{Table, exact_or_empty};

use super::npy::write_array;
use super::{OutputError, write_text};

/// Writes a matrix with the names of its rows and columns; entries that do not exist are empty.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_matrix_table(
    path: &Path,
    [rows, columns]: [&[String]; 2],
    entry: impl Fn(usize, usize) -> Option<f64>,
) -> Result<(), OutputError> {
    let mut table = Table::new([""].into_iter().chain(columns.iter().map(String::as_str)));
    for (i, name) in rows.iter().enumerate() {
        let entries = (0..columns.len()).map(|j| exact_or_empty(entry(i, j)));
        table.texts([name.clone()].into_iter().chain(entries));
    }
    write_text(path, &table.csv())
}

/// Writes a matrix as an array `(rows, columns)`; entries that do not exist are NaN.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_matrix_array(
    path: &Path,
    [rows, columns]: [usize; 2],
    entry: impl Fn(usize, usize) -> Option<f64>,
) -> Result<(), OutputError> {
    let at = |at: usize| entry(at / columns, at % columns).unwrap_or(f64::NAN);
    write_array(path, &[rows, columns], (0..rows * columns).map(at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn names_and_entries_are_there() {
        let place = tempfile::tempdir().unwrap();
        let (csv, npy) = (place.path().join("m.csv"), place.path().join("m.npy"));
        let names = ["plain".to_owned(), "a \"b\", c".to_owned()];
        let entry = |i: usize, j: usize| (i + j > 0).then_some((i + 2 * j) as f64 / 4.0);
        write_matrix_table(&csv, [&names; 2], entry).unwrap();
        assert_eq!(
            fs::read_to_string(&csv).unwrap(),
            ",plain,\"a \"\"b\"\", c\"\nplain,,5e-1\n\"a \"\"b\"\", c\",2.5e-1,7.5e-1\n"
        );
        write_matrix_array(&npy, [2, 2], entry).unwrap();
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
