//! Tables of named columns, as CSV, as Markdown, as HTML and as aligned text.

use serde::Serialize;

use crate::html::{Markup, element, head, row};

/// Rows of cells under the names of their columns.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<Cell>>,
}

/// A number or a text.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Cell {
    /// A number, written with all digits in CSV and with four elsewhere.
    Number(f64),
    /// A text, written unchanged.
    Text(String),
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<usize> for Cell {
    fn from(number: usize) -> Self {
        Self::Number(number as f64)
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

/// A text, or a dash.
impl<T: Into<String>> From<Option<T>> for Cell {
    fn from(text: Option<T>) -> Self {
        Self::Text(text.map_or_else(|| "-".to_owned(), Into::into))
    }
}

/// All digits of a number in scientific notation.
pub fn exact(number: f64) -> String {
    format!("{number:e}")
}

/// The same for an optional number; empty for `None`.
pub fn exact_or_empty(number: Option<f64>) -> String {
    number.map_or_else(String::new, exact)
}

impl Table {
    /// A table with these columns and no rows yet.
    pub fn new(columns: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self {
            columns: columns.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row with a cell for every column.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        let row: Vec<Cell> = cells.into_iter().collect();
        debug_assert_eq!(row.len(), self.columns.len());
        self.rows.push(row);
    }

    /// Adds a row of texts.
    pub fn texts(&mut self, cells: impl IntoIterator<Item = String>) {
        self.row(cells.into_iter().map(Cell::Text));
    }

    /// Adds a column, with a cell for every row.
    pub fn column(&mut self, name: &str, cells: impl IntoIterator<Item = Cell>) {
        self.columns.push(name.to_owned());
        for (row, cell) in self.rows.iter_mut().zip(cells) {
            row.push(cell);
        }
    }

    /// Formats the table as comma-separated values by RFC 4180, except that lines end with line
    /// feeds: cells with a comma, a quotation mark or a line break are quoted.
    pub fn csv(&self) -> String {
        self.lines(
            |cell| match cell {
                Cell::Number(number) => number.to_string(),
                Cell::Text(text) => text.clone(),
            },
            |cells| {
                let cells: Vec<String> = cells.iter().map(|cell| quoted(cell)).collect();
                match &cells[..] {
                    // An empty line would not be read as a row.
                    [only] if only.is_empty() => "\"\"".to_owned(),
                    _ => cells.join(","),
                }
            },
        )
        .concat()
    }

    /// Formats the table as Markdown.
    pub fn markdown(&self) -> String {
        let mut lines = self.lines(Cell::short, |cells| {
            let cells: Vec<String> = cells.iter().map(|cell| in_one_cell(cell)).collect();
            format!("| {} |", cells.join(" | "))
        });
        lines.insert(1, format!("|{}\n", "---|".repeat(self.columns.len())));
        lines.concat()
    }

    /// Formats the table as HTML; numbers are of the class `number`.
    pub fn html(&self) -> Markup {
        let cell = |cell: &Cell| match cell {
            Cell::Number(_) => element("td", &[("class", "number")], cell.short()),
            Cell::Text(text) => element("td", &[], text.as_str()),
        };
        let rows = self
            .rows
            .iter()
            .map(|cells| row("", cells.iter().map(cell)));
        let head = head(self.columns.iter().map(|name| Markup::from(name.as_str())));
        element(
            "table",
            &[],
            [head].into_iter().chain(rows).collect::<Markup>(),
        )
    }

    /// Formats the table as indented lines of text with aligned columns.
    pub fn aligned(&self, indent: &str) -> String {
        let mut widths = vec![0; self.columns.len()];
        self.lines(Cell::short, |cells| {
            for (width, cell) in widths.iter_mut().zip(cells) {
                *width = cell.chars().count().max(*width);
            }
            String::new()
        });
        let line = |cells: &[String]| {
            let cells = cells.iter().zip(&widths);
            let cells: Vec<String> = cells.map(|(cell, w)| format!("{cell:<w$}")).collect();
            format!("{indent}{}", cells.join("  ").trim_end())
        };
        self.lines(Cell::short, line).concat()
    }

    /// The head and all rows, each as a line with its end.
    fn lines(
        &self,
        cell: impl Fn(&Cell) -> String,
        mut line: impl FnMut(&[String]) -> String,
    ) -> Vec<String> {
        let rows = self.rows.iter().map(|row| row.iter().map(&cell).collect());
        std::iter::once(self.columns.clone())
            .chain(rows)
            .map(|cells: Vec<String>| line(&cells) + "\n")
            .collect()
    }
}

impl Cell {
    /// The text, or about four digits of the number.
    pub fn short(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number(x) if *x == 0.0 || x.fract() == 0.0 && x.abs() < 1e6 => x.to_string(),
            Self::Number(x) if (1e-3..1e4).contains(&x.abs()) => {
                let digits = (3.0 - x.abs().log10().floor()).clamp(0.0, 6.0) as usize;
                format!("{x:.digits$}")
            }
            Self::Number(x) => format!("{x:.3e}"),
        }
    }
}

fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

/// Escapes a text for a cell of a Markdown table.
fn in_one_cell(cell: &str) -> String {
    cell.replace('|', "\\|").replace(['\n', '\r'], " ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn tables_are_written_with_all_digits_and_read_with_few() {
        let mut table = Table::new(["case", "energy"]);
        table.row(["soft, thin".into(), (1.0 / 3.0).into()]);
        assert_eq!(
            table.csv(),
            "case,energy\n\"soft, thin\",0.3333333333333333\n"
        );
        assert_eq!(
            table.markdown(),
            "| case | energy |\n|---|---|\n| soft, thin | 0.3333 |\n"
        );
        assert_eq!(
            table.aligned("  "),
            "  case        energy\n  soft, thin  0.3333\n"
        );
        assert_eq!(exact(0.5), "5e-1");
        assert_eq!(exact_or_empty(None), "");
    }

    #[test]
    fn cells_of_html_are_escaped_and_numbers_are_marked() {
        let mut table = Table::new(["<b>", "n"]);
        table.row(["a & b".into(), 0.5.into()]);
        assert_eq!(
            table.html().as_str(),
            "<table>\n<tr><th>&lt;b&gt;</th><th>n</th></tr>\n<tr><td>a &amp; b</td>\
             <td class=\"number\">0.5000</td></tr>\n</table>\n"
        );
    }

    #[test]
    fn no_text_ends_a_cell_of_markdown() {
        let mut table = Table::new(["a|b"]);
        table.texts(["c\nd|".to_owned()]);
        assert_eq!(table.markdown(), "| a\\|b |\n|---|\n| c d\\| |\n");
    }

    proptest! {
        /// Another program reads what was written, for any text.
        #[test]
        fn comma_separated_values_are_read_back(
            columns in 1..5usize,
            texts in prop::collection::vec("[a-zß語 ,;\"'|\n\r\t]{0,6}", 5..40),
        ) {
            let rows: Vec<Vec<String>> = texts.chunks_exact(columns).map(<[_]>::to_vec).collect();
            let mut table = Table::new(rows[0].clone());
            for row in &rows[1..] {
                table.texts(row.clone());
            }
            let text = table.csv();
            let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(text.as_bytes());
            let found: Vec<Vec<String>> = reader
                .records()
                .map(|record| record.unwrap().iter().map(String::from).collect())
                .collect();
            prop_assert_eq!(found, rows);
        }
    }
}
