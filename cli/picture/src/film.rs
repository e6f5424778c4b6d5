//! A film strip: the pictures of a path in rows, and the density of each step below it.

use super::{Canvas, GREY, LABEL, PALE, scale, text};

/// Width of the whole picture where a row is full.
const WIDTH: usize = 1560;
/// Most tiles in a row.
const MOST: usize = 9;
/// Widest tile.
const MOST_TILE: usize = 260;
/// Space between tiles.
const SPACE: usize = 10;
/// Space at the border, and between rows.
const BORDER: usize = 18;

/// Everything in a film strip.
#[derive(Clone, Copy, Debug)]
pub struct FilmStrip<'a> {
    /// The shapes in order, all of one size, with their names.
    pub shapes: &'a [(String, Canvas)],
    /// The densities on all shapes but the last, of the same size, with their labels.
    pub densities: &'a [(String, Canvas)],
    /// The title of the colour scale.
    pub title: &'a str,
    /// The density at the dark end of the colours.
    pub most: f64,
}

/// Tiles in a row for this number of tiles: rows are about equally full.
fn columns(count: usize) -> usize {
    count.div_ceil(count.div_ceil(MOST).max(1)).max(1)
}

/// Width of one of this number of tiles.
pub fn tile_width(count: usize) -> usize {
    let columns = columns(count);
    ((WIDTH - 2 * BORDER - SPACE * (columns - 1)) / columns).min(MOST_TILE)
}

impl FilmStrip<'_> {
    /// Draws the strip.
    pub fn draw(&self) -> Canvas {
        let columns = columns(self.shapes.len());
        let rows = self.shapes.len().div_ceil(columns);
        let tile = self
            .shapes
            .first()
            .map_or([1; 2], |(_, shape)| shape.size());
        let pitch = 2 * (tile[1] + LABEL) + BORDER;
        let inner = columns * (tile[0] + SPACE) - SPACE;
        // The legend needs its room even under two tiles.
        let width = (inner + 2 * BORDER).max(2 * MOST_TILE + 4 * BORDER);
        let mut canvas = Canvas::new(width, BORDER + rows * pitch + LABEL);
        let left = (width - inner) / 2;
        let corner = |k: usize| {
            [
                left + (k % columns) * (tile[0] + SPACE),
                BORDER + (k / columns) * pitch,
            ]
        };
        for (k, (label, shape)) in self.shapes.iter().enumerate() {
            place(&mut canvas, shape, corner(k), label);
        }
        for (k, (label, density)) in self.densities.iter().enumerate() {
            let [x, y] = corner(k);
            place(&mut canvas, density, [x, y + tile[1] + LABEL], label);
        }
        let bottom = [BORDER, BORDER + rows * pitch - 4];
        scale::legend(
            &mut canvas,
            self.title,
            self.most,
            bottom,
            width - 2 * BORDER,
        );
        canvas
    }
}

/// Puts a picture on another, with a frame and its name under it.
pub(crate) fn place(canvas: &mut Canvas, picture: &Canvas, corner: [usize; 2], label: &str) {
    canvas.paste(picture, corner);
    canvas.frame(corner, picture.size(), PALE);
    let width = picture.size()[0] as f32;
    let middle = [
        corner[0] as f32 + 0.5 * width,
        (corner[1] + picture.size()[1] + 8) as f32,
    ];
    text::centred(canvas, label, middle, text::SIZE, width, GREY);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_about_equally_full() {
        let found = [2, 9, 10, 17, 18, 19, 0].map(columns);
        assert_eq!(found, [2, 9, 5, 9, 9, 7, 1]);
        assert!(tile_width(17) > 150 && tile_width(3) == MOST_TILE);
    }

    #[test]
    fn every_shape_and_density_has_its_place() {
        for count in [1, 2, 17] {
            let tile = [tile_width(count), 70];
            let dark = |grey: f32| {
                let mut canvas = Canvas::new(tile[0], tile[1]);
                canvas.blend(30, 30, [grey; 3], 1.0);
                canvas
            };
            let shapes: Vec<_> = (0..count)
                .map(|k| (k.to_string(), dark(k as f32 / 100.0)))
                .collect();
            let strip = FilmStrip {
                shapes: &shapes,
                densities: &shapes[1..],
                title: "density",
                most: 1.5,
            };
            let canvas = strip.draw();
            let [width, height] = canvas.size();
            for (k, place) in shapes.iter().map(|(_, s)| s.pixel(30, 30)).enumerate() {
                let times = (0..width * height)
                    .filter(|i| canvas.pixel(i % width, i / width) == place)
                    .count();
                assert!(times >= if k == 0 { 1 } else { 2 }, "{count} {k} {times}");
            }
        }
    }
}
