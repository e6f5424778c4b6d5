//! The content of a figure: a picture and a table.

use fe_grid::{Grid, ScalarField};
use levelset::Contour;
use shape_average::AverageResult;
use shapespace_report::table::Table;

use crate::picture::{Canvas, Colour, INK, Slice, TileRows, WHITE, colour, mix};

/// A picture and a table.
pub(super) struct Sheet {
    /// One line that says what is shown.
    pub title: &'static str,
    /// Explanation of the picture and the columns.
    pub text: String,
    pub table: Table,
    pub picture: Canvas,
}

/// Tiles of averages and their inputs.
pub(super) struct Tiles<const D: usize> {
    rows: TileRows,
    pub slice: Slice<D>,
}

impl<const D: usize> Tiles<D> {
    /// Rows with this number of tiles.
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
