//! The content of a figure: a picture and a table.

use fe_grid::{Grid, ScalarField};
use levelset::Contour;
use shape_average::AverageResult;
use shapespace_report::table::{Cell, Table};

use shapespace_picture::{Canvas, Colour, INK, Slice, TileRows, WHITE, colour, mix};

/// A picture and a table.
pub(super) struct Sheet {
    /// The title in one line.
    pub title: &'static str,
    /// Explanation of the picture and the columns.
    pub text: String,
    pub table: Table,
    pub picture: Canvas,
}

/// The columns for every average.
const USUAL: [&str; 5] = [
    "elastic energy",
    "mismatch",
    "mean Dice",
    "least det",
    "certified",
];

/// The cells of [`USUAL`]: mean elastic energy and mean mismatch of the shapes, mean overlap, and the
/// certificate of the worst deformation.
fn usual<const D: usize>(result: &AverageResult<D>) -> Vec<Cell> {
    let n = result.dice.len() as f64;
    let mean = |terms: &[f64]| terms.iter().sum::<f64>() / n;
    let certified = if result.certificate.certified {
        "yes"
    } else {
        "no"
    };
    vec![
        mean(&result.energy.elastic).into(),
        mean(&result.energy.mismatch).into(),
        result.mean_dice().into(),
        result.certificate.min_det.into(),
        certified.into(),
    ]
}

/// Averages side by side, each with a row of a table and a tile.
pub(super) struct Comparison<const D: usize> {
    pub table: Table,
    pub tiles: Tiles<D>,
}

impl<const D: usize> Comparison<D> {
    /// A table with columns before and after [`USUAL`], and this number of tiles per row.
    pub fn new(
        grid: &Grid<D>,
        tiles: usize,
        first: &[&'static str],
        last: &[&'static str],
    ) -> Self {
        Self {
            table: Table::new([first, &USUAL, last].concat()),
            tiles: Tiles::new(grid, tiles),
        }
    }

    /// Adds an average, with the cells of the columns before and after [`USUAL`].
    pub fn add(
        &mut self,
        label: &str,
        first: impl IntoIterator<Item: Into<Cell>>,
        result: &AverageResult<D>,
        last: impl IntoIterator<Item: Into<Cell>>,
    ) {
        self.tiles.average(label, result);
        self.row(first, result, last);
    }

    /// Adds a row without a tile.
    pub fn row(
        &mut self,
        first: impl IntoIterator<Item: Into<Cell>>,
        result: &AverageResult<D>,
        last: impl IntoIterator<Item: Into<Cell>>,
    ) {
        let first = first.into_iter().map(Into::into);
        let last = last.into_iter().map(Into::into);
        let row: Vec<Cell> = first.chain(usual(result)).chain(last).collect();
        self.table.row(row);
    }

    /// The figure.
    pub fn sheet(self, title: &'static str, text: impl Into<String>) -> Sheet {
        Sheet {
            title,
            text: text.into(),
            table: self.table,
            picture: self.tiles.draw(),
        }
    }
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
        let tile = self.averaged(result);
        self.rows.push(label, tile);
    }

    /// The picture of such a tile.
    pub fn averaged(&self, result: &AverageResult<D>) -> Canvas {
        let indicator = &result.average_indicator;
        let pale = mix(WHITE, INK, 0.25);
        let mut tile = self
            .slice
            .painted(|x| mix(WHITE, pale, indicator.sample(x)[0] as f32));
        for (i, pushed) in result.pushed.iter().enumerate() {
            self.slice.level(&mut tile, pushed, 0.0, 0.7, colour(i));
        }
        self.slice.level(&mut tile, indicator, 0.5, 1.4, INK);
        tile
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
