//! Tables of measurements in Markdown.

use std::fmt;

use shapespace_report::table;

/// Rows of cells under a heading.
pub struct Table(table::Table);

impl Table {
    /// A table with these columns.
    pub fn new<const N: usize>(columns: [&str; N]) -> Self {
        Self(table::Table::new(columns))
    }

    /// Adds a row, and prints it to standard error, as the rest may take long.
    pub fn row(&mut self, cells: impl Into<Vec<String>>) {
        let cells = cells.into();
        eprintln!("  {}", cells.join(" | "));
        self.0.texts(cells);
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.markdown())
    }
}

/// A cell that is marked if it does not meet its requirement.
pub fn checked(text: String, good: bool) -> String {
    if good { text } else { format!("{text} **!**") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_markdown() {
        let mut table = Table::new(["a", "b"]);
        table.row(["1".into(), checked("2".into(), false)]);
        assert_eq!(table.to_string(), "| a | b |\n|---|---|\n| 1 | 2 **!** |\n");
    }
}
