//! Fields of numbers as tiles: whole planes, and the plane through the middle of volumes.

use fe_grid::{Field, Grid};
use levelset::{BoxEdge, Contour, contour};

use super::film::place;
use super::{Canvas, Colour, GAP, LABEL, mix};

/// Width of a picture of tiles.
const WIDTH: usize = 1240;

/// A plane of a box, orthogonal to the last axis in 3D, as a picture.
#[derive(Clone, Copy, Debug)]
pub struct Slice<const D: usize> {
    /// Coordinates of the first corner along `x` and `y`.
    low: [f64; 2],
    /// Pixels of one unit.
    scale: f64,
    /// Pixels along `x` and `y`.
    size: [usize; 2],
    /// Coordinate of the plane along the last axis; not used in 2D.
    height: f64,
}

impl<const D: usize> Slice<D> {
    /// The plane through the middle of a grid, in a picture of this width.
    pub fn middle(grid: &Grid<D>, width: usize) -> Self {
        let extent = grid.extent();
        let scale = width as f64 / extent[0];
        Self {
            low: [0.0; 2],
            scale,
            size: [width, ((scale * extent[1]).round() as usize).max(1)],
            height: 0.5 * extent[D - 1],
        }
    }

    /// The plane through the middle of the box between two corners, in a square picture of this side
    /// that shows the box with some room around it.
    pub fn around(low: &[f64; D], high: &[f64; D], side: usize) -> Self {
        const ROOM: f64 = 1.14;
        let longest = (high[0] - low[0]).max(high[1] - low[1]).max(1e-6);
        let middle = |k: usize| 0.5 * (low[k] + high[k]);
        Self {
            low: [0, 1].map(|k| middle(k) - 0.5 * ROOM * longest),
            scale: side as f64 / (ROOM * longest),
            size: [side; 2],
            height: middle(D - 1),
        }
    }

    /// Pixels along both sides.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The coordinate of the plane along the last axis.
    pub fn height(&self) -> f64 {
        self.height
    }

    fn point(&self, x: usize, y: usize) -> [f64; D] {
        let mut point = [self.height; D];
        point[0] = self.low[0] + (x as f64 + 0.5) / self.scale;
        point[1] = self.low[1] + (y as f64 + 0.5) / self.scale;
        point
    }

    /// A picture in which every point has its own colour.
    pub fn painted(&self, colour: impl Fn([f64; D]) -> Colour) -> Canvas {
        let mut canvas = Canvas::new(self.size[0], self.size[1]);
        for y in 0..self.size[1] {
            for x in 0..self.size[0] {
                canvas.blend(x, y, colour(self.point(x, y)), 1.0);
            }
        }
        canvas
    }

    /// A field as grey values: 0 is black, 1 is white.
    pub fn grey(&self, field: &Field<f64, D, 1>) -> Canvas {
        self.painted(|x| [field.sample(x)[0].clamp(0.0, 1.0) as f32; 3])
    }

    /// Lays a colour over a picture where a phase field is small.
    pub fn mark(&self, canvas: &mut Canvas, phase_field: &Field<f64, D, 1>, colour: Colour) {
        for y in 0..self.size[1] {
            for x in 0..self.size[0] {
                let v = phase_field.sample(self.point(x, y))[0];
                canvas.blend(x, y, colour, (1.0 - v) as f32);
            }
        }
    }

    /// Draws the boundary of `{field > level}`; none where there is none.
    pub fn level(
        &self,
        canvas: &mut Canvas,
        field: &Field<f64, D, 1>,
        level: f64,
        width: f32,
        colour: Colour,
    ) {
        if let Ok(boundary) = contour(field, level, BoxEdge::Open) {
            self.outline(canvas, &boundary, width, colour);
        }
    }

    /// Draws a line, projected along the last axis in 3D.
    pub fn line(&self, canvas: &mut Canvas, points: &[[f64; D]], width: f32, colour: Colour) {
        let points: Vec<[f32; 2]> = points.iter().map(|p| self.pixels(p)).collect();
        canvas.line(&points, false, width, colour);
    }

    fn pixels(&self, point: &[f64; D]) -> [f32; 2] {
        [0, 1].map(|k| (self.scale * (point[k] - self.low[k])) as f32)
    }

    /// Draws a boundary where it meets the plane.
    pub fn outline(&self, canvas: &mut Canvas, contour: &Contour<D>, width: f32, colour: Colour) {
        for corners in contour.all_corners() {
            let ends = if D == 2 {
                corners.to_vec()
            } else {
                self.crossings(&corners)
            };
            if ends.len() == 2 {
                self.line(canvas, &ends, width, colour);
            }
        }
    }

    /// Where the edges of a triangle cross the plane.
    fn crossings(&self, corners: &[[f64; D]; D]) -> Vec<[f64; D]> {
        let above = |p: &[f64; D]| p[D - 1] > self.height;
        let pairs = (0..D).map(|i| (corners[i], corners[(i + 1) % D]));
        pairs
            .filter(|(a, b)| above(a) != above(b))
            .map(|(a, b)| {
                let t = (self.height - a[D - 1]) / (b[D - 1] - a[D - 1]);
                std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
            })
            .collect()
    }
}

/// Tiles in rows of this number.
#[derive(Clone, Debug)]
pub struct TileRows {
    columns: usize,
    tiles: Vec<(String, Canvas)>,
}

impl TileRows {
    /// Rows without tiles yet.
    pub fn new(columns: usize) -> Self {
        Self {
            columns,
            tiles: Vec::new(),
        }
    }

    /// The width of a tile in rows of this number.
    pub fn width(columns: usize) -> usize {
        (WIDTH - GAP * (columns + 1)) / columns
    }

    /// The next tile, with the line of text under it.
    pub fn push(&mut self, label: impl Into<String>, tile: Canvas) {
        self.tiles.push((label.into(), tile));
    }

    /// Ends a row where it is.
    pub fn end_row(&mut self) {
        while !self.tiles.len().is_multiple_of(self.columns) {
            self.tiles.push((String::new(), Canvas::new(1, 1)));
        }
    }

    /// Draws the picture.
    pub fn draw(&self) -> Canvas {
        let rows: Vec<&[(String, Canvas)]> = self.tiles.chunks(self.columns).collect();
        let tallest = |row: &[(String, Canvas)]| {
            let heights = row.iter().map(|(_, tile)| tile.size()[1]);
            heights.max().unwrap_or(0)
        };
        let heights: Vec<usize> = rows.iter().map(|row| tallest(row) + LABEL + GAP).collect();
        let mut canvas = Canvas::new(WIDTH, GAP + heights.iter().sum::<usize>());
        let mut y = GAP;
        for (row, height) in rows.iter().zip(heights) {
            for (k, (label, tile)) in row.iter().enumerate() {
                if tile.size() != [1, 1] {
                    let x = GAP + k * (Self::width(self.columns) + GAP);
                    place(&mut canvas, tile, [x, y], label);
                }
            }
            y += height;
        }
        canvas
    }
}

/// A grey value made paler.
pub fn pale(grey: f64) -> Colour {
    let grey = grey.clamp(0.0, 1.0) as f32;
    mix([grey; 3], super::WHITE, 0.4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::ScalarField;

    /// A ball is cut by the middle plane in its great circle.
    #[test]
    fn planes_are_cut_from_volumes() {
        let grid = Grid::<3>::cube(33);
        let ball = ScalarField::from_fn(grid, |x: [f64; 3]| {
            let square: f64 = x.iter().map(|x| (x - 0.5).powi(2)).sum();
            [0.3 - square.sqrt()]
        });
        let slice = Slice::middle(&grid, 100);
        let mut canvas = slice.painted(|_| [1.0; 3]);
        slice.level(&mut canvas, &ball, 0.0, 2.0, [0.0; 3]);
        let dark: f32 = (0..10_000)
            .map(|i| 1.0 - canvas.pixel(i % 100, i / 100)[0])
            .sum();
        let length = std::f32::consts::TAU * 30.0;
        // Joints of the short segments are laid on twice.
        assert!((dark / (2.0 * length) - 1.0).abs() < 0.25, "{dark}");
        assert!(canvas.pixel(50, 20)[0] < 0.5 && canvas.pixel(50, 50)[0] == 1.0);
        let grey = slice.grey(&ball);
        assert!((grey.pixel(50, 50)[0] - 0.3).abs() < 0.02);
    }

    #[test]
    fn a_plane_shows_a_part_of_its_box() {
        let slice = Slice::<3>::around(&[0.2, 0.4, 0.1], &[0.4, 0.5, 0.7], 114);
        assert!((slice.height() - 0.4).abs() < 1e-12);
        let left = slice.point(7, 57);
        let expected = [0.2 + 0.001, 0.45 + 0.001, 0.4];
        assert!(
            (0..3).all(|k| (left[k] - expected[k]).abs() < 1e-4),
            "{left:?}"
        );
        let back = slice.pixels(&left);
        assert!((back[0] - 7.5).abs() < 1e-3 && (back[1] - 57.5).abs() < 1e-3);
    }

    #[test]
    fn rows_hold_their_tiles() {
        let mut rows = TileRows::new(2);
        for k in 0..3 {
            rows.push(k.to_string(), Canvas::new(TileRows::width(2), 40 + 10 * k));
        }
        rows.end_row();
        let [width, height] = rows.draw().size();
        assert_eq!((width, height), (WIDTH, GAP + 50 + 60 + 2 * (LABEL + GAP)));
    }
}
