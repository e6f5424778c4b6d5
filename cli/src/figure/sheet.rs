//! What a figure comes to: a picture and a table.

use std::fmt::Write as _;

use fe_grid::{Grid, ScalarField};
use levelset::Contour;
use serde::Serialize;
use shape_average::AverageResult;

use crate::picture::{Canvas, Colour, INK, Slice, TileRows, WHITE, colour, mix};

/// A picture and a table.
pub(super) struct Sheet {
    /// One line that says what is shown.
    pub title: &'static str,
    /// What is to be seen, and what the columns are.
    pub text: String,
    pub table: Table,
    pub picture: Canvas,
}

/// Named columns of numbers and words.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Table {
    pub columns: Vec<&'static str>,
    pub rows: Vec<Vec<Cell>>,
}

/// A number or a word.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum Cell {
    Number(f64),
    Word(String),
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

impl<T: Into<String>> From<Option<T>> for Cell {
    fn from(word: Option<T>) -> Self {
        Self::Word(word.map_or_else(|| "-".to_owned(), Into::into))
    }
}

impl From<String> for Cell {
    fn from(word: String) -> Self {
        Self::Word(word)
    }
}

impl From<&str> for Cell {
    fn from(word: &str) -> Self {
        Self::Word(word.to_owned())
    }
}

impl Table {
    pub fn new(columns: &[&'static str]) -> Self {
        Self {
            columns: columns.to_vec(),
            rows: Vec::new(),
        }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        let row: Vec<Cell> = cells.into_iter().collect();
        debug_assert_eq!(row.len(), self.columns.len());
        self.rows.push(row);
    }

    /// As text, cells parted by commas, all digits of numbers.
    pub fn csv(&self) -> String {
        let mut text = self.columns.join(",");
        text.push('\n');
        for row in &self.rows {
            let cells: Vec<String> = row
                .iter()
                .map(|cell| match cell {
                    Cell::Number(x) => x.to_string(),
                    Cell::Word(word) => word.replace(',', ";"),
                })
                .collect();
            let _ = writeln!(text, "{}", cells.join(","));
        }
        text
    }

    /// As text, aligned in columns.
    pub fn words(&self) -> String {
        let mut rows = vec![self.columns.iter().map(ToString::to_string).collect()];
        rows.extend(
            self.rows
                .iter()
                .map(|row| row.iter().map(Cell::words).collect()),
        );
        let rows: Vec<Vec<String>> = rows;
        let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max();
        let widths: Vec<usize> = (0..self.columns.len()).filter_map(width).collect();
        let mut text = String::new();
        for row in &rows {
            let cells: Vec<String> = row
                .iter()
                .zip(&widths)
                .map(|(cell, width)| format!("{cell:<width$}"))
                .collect();
            let _ = writeln!(text, "  {}", cells.join("  ").trim_end());
        }
        text
    }

    /// As Markdown.
    pub fn markdown(&self) -> String {
        let mut text = format!("| {} |\n", self.columns.join(" | "));
        text.push('|');
        text.push_str(&"---|".repeat(self.columns.len()));
        text.push('\n');
        for row in &self.rows {
            let cells: Vec<String> = row.iter().map(Cell::words).collect();
            let _ = writeln!(text, "| {} |", cells.join(" | "));
        }
        text
    }
}

impl Cell {
    fn words(&self) -> String {
        match self {
            Self::Word(word) => word.clone(),
            Self::Number(x) if *x == 0.0 || x.fract() == 0.0 && x.abs() < 1e6 => x.to_string(),
            Self::Number(x) if (1e-3..1e4).contains(&x.abs()) => {
                let digits = (3.0 - x.abs().log10().floor()).clamp(0.0, 6.0) as usize;
                format!("{x:.digits$}")
            }
            Self::Number(x) => format!("{x:.3e}"),
        }
    }
}

/// Tiles of averages and their inputs.
pub(super) struct Tiles<const D: usize> {
    rows: TileRows,
    pub slice: Slice<D>,
}

impl<const D: usize> Tiles<D> {
    /// Rows of so many tiles.
    pub fn new(grid: &Grid<D>, columns: usize) -> Self {
        Self {
            rows: TileRows::new(columns),
            slice: Slice::middle(grid, TileRows::width(columns)),
        }
    }

    /// A tile with boundaries in the colours of their numbers.
    pub fn shapes(&mut self, label: &str, shapes: &[ScalarField<f64, D>], level: f64) {
        let mut tile = self.slice.painted(|_| WHITE);
        for (i, shape) in shapes.iter().enumerate() {
            self.slice.level(&mut tile, shape, level, 1.2, colour(i));
        }
        self.rows.push(label, tile);
    }

    /// A tile with an average, and the boundaries of the shapes deformed onto it.
    pub fn average(&mut self, label: &str, result: &AverageResult<D>) {
        let indicator = &result.average_indicator;
        let pale = mix(WHITE, INK, 0.25);
        let mut tile = self
            .slice
            .painted(|x| mix(WHITE, pale, indicator.sample(x)[0] as f32));
        for (i, pushed) in result.pushed.iter().enumerate() {
            self.slice.level(&mut tile, pushed, 0.0, 0.7, colour(i));
        }
        self.slice.level(&mut tile, indicator, 0.5, 1.4, INK);
        self.rows.push(label, tile);
    }

    /// A tile with boundaries over each other.
    pub fn outlines(&mut self, label: &str, contours: &[(&Contour<D>, Colour)]) {
        let mut tile = self.slice.painted(|_| WHITE);
        for (contour, colour) in contours {
            self.slice.outline(&mut tile, contour, 1.3, *colour);
        }
        self.rows.push(label, tile);
    }

    /// A tile that was drawn elsewhere.
    pub fn push(&mut self, label: &str, tile: Canvas) {
        self.rows.push(label, tile);
    }

    pub fn end_row(&mut self) {
        self.rows.end_row();
    }

    pub fn draw(&self) -> Canvas {
        self.rows.draw()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_written_with_all_digits_and_read_with_few() {
        let mut table = Table::new(&["case", "energy"]);
        table.row(["soft, thin".into(), (1.0 / 3.0).into()]);
        assert_eq!(table.csv(), "case,energy\nsoft; thin,0.3333333333333333\n");
        assert_eq!(
            table.markdown(),
            "| case | energy |\n|---|---|\n| soft, thin | 0.3333 |\n"
        );
        assert_eq!(
            table.words(),
            "  case        energy\n  soft, thin  0.3333\n"
        );
    }
}
