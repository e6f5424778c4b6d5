//! Pictures of shapes and results: plain arrays, polylines and meshes in, PNG out.
//!
//! The `y` axis of flat shapes points down, as in the input pictures (see the inputs of the program).

#![forbid(unsafe_code)]

mod analogy;
mod canvas;
mod curve;
mod film;
mod key;
mod matrix;
mod mesh;
mod plot;
pub mod png;
mod scale;
mod scatter;
mod shape;
mod sheet2;
mod sheet3;
mod slice;
mod text;
mod tiles;
mod tree;
mod window;

pub use analogy::analogy;
pub use canvas::Canvas;
pub use curve::Curve;
pub use film::{FilmStrip, tile_width};
pub use key::Key;
pub use matrix::HeatMap;
pub use mesh::{Bounds, Paint, PaintedSurface, Surface, View};
pub use plot::{LinePlot, PlotLine};
pub use scale::ColourBar;
pub use scatter::{Axis, GroupCurve, ScatterPlot};
pub use shape::{Camera, Shape, joined};
pub use sheet2::{ContactSheet, ShapeTile};
pub use sheet3::SurfaceSheet;
pub use slice::{Slice, TileRows, pale};
pub use tiles::Tiles;
pub use tree::TreeChart;
pub use window::Window;

pub use shapespace_report::palette::{
    Colour, INK, Marker, WHITE, colour, dashes, deviation, heat, mix, solid, time, tint,
};
use shapespace_report::palette::{GREY, PALE};

/// Tiles of equal size in rows, centred; gives the upper left corner of every tile.
struct Rows {
    columns: usize,
    count: usize,
    tile: usize,
    /// Height of a row: tile, label and gap.
    pitch: usize,
}

/// Space between tiles, and at the border.
const GAP: usize = 18;
/// Height of the line of text under a tile.
const LABEL: usize = 22;

impl Rows {
    /// Rows of tiles that fill the width, a tile being no wider than `most`.
    fn fill(count: usize, width: usize, most: usize) -> Self {
        let columns = match count {
            0..=6 => count.max(1),
            7 | 8 => 4,
            9 | 10 => 5,
            _ => count.div_ceil(count.div_ceil(8)).max(6),
        };
        let tile = ((width - GAP * (columns - 1)) / columns).min(most);
        Self {
            columns,
            count,
            tile,
            pitch: tile + LABEL + GAP,
        }
    }

    /// The same with tiles of this height.
    fn of_height(self, height: usize) -> Self {
        Self {
            pitch: height + LABEL + GAP,
            ..self
        }
    }

    fn height(&self) -> usize {
        self.count.div_ceil(self.columns) * self.pitch
    }

    fn corner(&self, index: usize, width: usize) -> [usize; 2] {
        let (row, column) = (index / self.columns, index % self.columns);
        let in_row = self.columns.min(self.count - row * self.columns);
        let used = in_row * self.tile + (in_row - 1) * GAP;
        [
            (width - used) / 2 + column * (self.tile + GAP),
            row * self.pitch,
        ]
    }
}
