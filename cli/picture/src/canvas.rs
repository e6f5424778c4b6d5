//! A picture in memory with anti-aliased lines.

use std::io;
use std::path::Path;

use ::png::{BitDepth, ColorType};

use super::{Colour, WHITE};
use crate::png::encode;

/// A picture, white at first. Pixel `(i, j)` fills `[i, i + 1] x [j, j + 1]`, `j` growing downwards.
#[derive(Clone, Debug)]
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Colour>,
}

impl Canvas {
    /// A white picture.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            pixels: vec![WHITE; width * height],
        }
    }

    /// Pixels along `x` and `y`.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The colour of a pixel.
    pub fn pixel(&self, x: usize, y: usize) -> Colour {
        self.pixels[y * self.width + x]
    }

    /// Lays a colour over a pixel; pixels outside the picture are left out.
    pub fn blend(&mut self, x: usize, y: usize, colour: Colour, opacity: f32) {
        if x < self.width && y < self.height {
            let pixel = &mut self.pixels[y * self.width + x];
            *pixel = super::mix(*pixel, colour, opacity.clamp(0.0, 1.0));
        }
    }

    /// Puts another picture on top.
    pub fn paste(&mut self, other: &Self, corner: [usize; 2]) {
        for y in 0..other.height {
            for x in 0..other.width {
                self.blend(corner[0] + x, corner[1] + y, other.pixel(x, y), 1.0);
            }
        }
    }

    /// Puts another picture on top, of which white is transparent.
    pub fn overlay(&mut self, other: &Self, corner: [usize; 2]) {
        for y in 0..other.height {
            for x in 0..other.width {
                let pixel = other.pixel(x, y);
                if pixel != WHITE {
                    self.blend(corner[0] + x, corner[1] + y, pixel, 1.0);
                }
            }
        }
    }

    /// The picture with this number of pixels along its longer side, if it is larger: each is the mean of what
    /// it covers.
    pub fn reduced(&self, side: usize) -> Self {
        let factor = self.width.max(self.height) as f64 / side.max(1) as f64;
        if factor <= 1.0 {
            return self.clone();
        }
        let size = |n: usize| ((n as f64 / factor).round() as usize).max(1);
        let mut small = Self::new(size(self.width), size(self.height));
        let columns = spans(self.width, small.width);
        let rows = spans(self.height, small.height);
        for (y, row) in rows.iter().enumerate() {
            for (x, column) in columns.iter().enumerate() {
                let mut sum = [0.0; 3];
                let mut all = 0.0;
                for &(j, down) in row {
                    for &(i, across) in column {
                        let pixel = self.pixel(i, j);
                        sum = std::array::from_fn(|k| sum[k] + down * across * pixel[k]);
                        all += down * across;
                    }
                }
                small.pixels[y * small.width + x] = sum.map(|c| c / all);
            }
        }
        small
    }

    /// A frame of one pixel inside a rectangle.
    pub fn frame(&mut self, corner: [usize; 2], size: [usize; 2], colour: Colour) {
        let [x, y] = corner;
        for i in 0..size[0] {
            self.blend(x + i, y, colour, 1.0);
            self.blend(x + i, y + size[1] - 1, colour, 1.0);
        }
        for j in 0..size[1] {
            self.blend(x, y + j, colour, 1.0);
            self.blend(x + size[0] - 1, y + j, colour, 1.0);
        }
    }

    /// Draws a line through points with round joints. The line is laid on once, so that it does
    /// not darken where its pieces meet or cross.
    pub fn line(&mut self, points: &[[f32; 2]], closed: bool, width: f32, colour: Colour) {
        let Some(mut cover) = Cover::new(self, points, width) else {
            return;
        };
        for pair in points.windows(2) {
            cover.segment(pair[0], pair[1]);
        }
        if let (true, [first, .., last]) = (closed, points) {
            cover.segment(*last, *first);
        }
        for j in 0..cover.size[1] {
            for i in 0..cover.size[0] {
                let share = cover.share[j * cover.size[0] + i];
                if share > 0.0 {
                    self.blend(cover.corner[0] + i, cover.corner[1] + j, colour, share);
                }
            }
        }
    }

    /// Draws a line in dashes of the first length, with gaps of the second between them.
    pub fn dashed(
        &mut self,
        points: &[[f32; 2]],
        closed: bool,
        lengths: [f32; 2],
        width: f32,
        colour: Colour,
    ) {
        let mut all = points.to_vec();
        all.extend(points.first().filter(|_| closed));
        for dash in dashes(&all, lengths) {
            self.line(&dash, false, width, colour);
        }
    }

    /// Fills the inside of closed curves: the points inside an odd number of them.
    pub fn fill(&mut self, curves: &[Vec<[f32; 2]>], colour: Colour) {
        const ROWS: usize = 8;
        let mut share = vec![0.0; self.width];
        for y in rows(curves, self.height) {
            share.fill(0.0);
            for row in 0..ROWS {
                let height = y as f32 + (row as f32 + 0.5) / ROWS as f32;
                for pair in crossings(curves, height).chunks_exact(2) {
                    cover_span(&mut share, pair[0], pair[1], 1.0 / ROWS as f32);
                }
            }
            for (x, part) in share.iter().enumerate() {
                if *part > 0.0 {
                    self.blend(x, y, colour, *part);
                }
            }
        }
    }

    /// Red, green and blue of all pixels as bytes, row by row.
    pub fn bytes(&self) -> Vec<u8> {
        let pixels = self.pixels.as_flattened().iter();
        // Rounds, and keeps within [0, 255].
        pixels.map(|c| (255.0 * c + 0.5) as u8).collect()
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// Those of [`encode`], for a picture without pixels.
    pub fn png(&self) -> io::Result<Vec<u8>> {
        encode(
            self.size(),
            (ColorType::Rgb, BitDepth::Eight),
            &self.bytes(),
        )
    }

    /// Writes the picture as a PNG file.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write_png(&self, path: &Path) -> io::Result<()> {
        std::fs::write(path, self.png()?)
    }
}

/// What each of a few pixels in a row covers of many: their places, and the shares of them.
fn spans(many: usize, few: usize) -> Vec<Vec<(usize, f32)>> {
    let factor = many as f64 / few as f64;
    let span = |k: usize| {
        let (from, to) = (k as f64 * factor, (k + 1) as f64 * factor);
        let inside = from as usize..(to.ceil() as usize).min(many);
        inside
            .map(|i| (i, (to.min(i as f64 + 1.0) - from.max(i as f64)) as f32))
            .collect()
    };
    (0..few).map(span).collect()
}

/// The pieces of a line that are dashes, of the first length with gaps of the second.
fn dashes(points: &[[f32; 2]], lengths: [f32; 2]) -> Vec<Vec<[f32; 2]>> {
    let mut found = Vec::new();
    let mut dash: Vec<[f32; 2]> = points.first().copied().into_iter().collect();
    let (mut within, mut left) = (true, lengths[0]);
    for pair in points.windows(2) {
        let side = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let length = side[0].hypot(side[1]);
        let mut along = 0.0;
        while length - along > left {
            along += left;
            let place = [0, 1].map(|k| pair[0][k] + along / length * side[k]);
            dash.push(place);
            if within {
                found.push(std::mem::take(&mut dash));
            }
            within = !within;
            left = lengths[usize::from(!within)];
        }
        left -= length - along;
        if within {
            dash.push(pair[1]);
        }
    }
    found.extend(Some(dash).filter(|dash| dash.len() > 1));
    found
}

/// The rows of pixels that curves reach, up to a height.
fn rows(curves: &[Vec<[f32; 2]>], height: usize) -> std::ops::Range<usize> {
    let values = || curves.iter().flatten().map(|p| p[1]);
    let low = values().fold(f32::INFINITY, f32::min).max(0.0);
    let high = values().fold(0.0, f32::max).ceil();
    low as usize..(high as usize).min(height)
}

/// Where closed curves cross a horizontal line, in order.
fn crossings(curves: &[Vec<[f32; 2]>], height: f32) -> Vec<f32> {
    let mut found = Vec::new();
    for curve in curves {
        for (i, b) in curve.iter().enumerate() {
            let a = curve[(i + curve.len() - 1) % curve.len()];
            if (a[1] > height) != (b[1] > height) {
                found.push(a[0] + (height - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
            }
        }
    }
    found.sort_by(f32::total_cmp);
    found
}

/// Adds to every pixel of a row the part of it that lies between two places.
fn cover_span(share: &mut [f32], from: f32, to: f32, weight: f32) {
    let (from, to) = (from.max(0.0), to.min(share.len() as f32));
    // An empty range for NaN and for spans beside the row.
    for x in from as usize..(to.ceil() as usize).min(share.len()) {
        let part = to.min(x as f32 + 1.0) - from.max(x as f32);
        share[x] += weight * part.clamp(0.0, 1.0);
    }
}

/// Share of every pixel that a line covers, in the line's bounding box.
struct Cover {
    corner: [usize; 2],
    size: [usize; 2],
    half_width: f32,
    share: Vec<f32>,
}

impl Cover {
    /// `None` where the line does not touch the picture.
    fn new(canvas: &Canvas, points: &[[f32; 2]], width: f32) -> Option<Self> {
        let reach = 0.5 * width + 1.0;
        let mut corner = [0; 2];
        let mut size = [0; 2];
        for (k, most) in canvas.size().into_iter().enumerate() {
            let values = || points.iter().map(|p| p[k]);
            let low = values().fold(f32::INFINITY, f32::min) - reach;
            let high = values().fold(f32::NEG_INFINITY, f32::max) + reach;
            // Neither holds for NaN, and no points give an infinite range.
            let touches = low < most as f32 && high > 0.0;
            if !touches {
                return None;
            }
            corner[k] = low.max(0.0) as usize;
            size[k] = (high.ceil() as usize).min(most) - corner[k];
        }
        Some(Self {
            corner,
            size,
            half_width: 0.5 * width,
            share: vec![0.0; size[0] * size[1]],
        })
    }

    fn segment(&mut self, a: [f32; 2], b: [f32; 2]) {
        let reach = self.half_width + 1.0;
        let range = |k: usize| {
            let (low, high) = (a[k].min(b[k]) - reach, a[k].max(b[k]) + reach);
            let inside = |v: f32| (v - self.corner[k] as f32).clamp(0.0, self.size[k] as f32);
            inside(low.floor()) as usize..inside(high.ceil()) as usize
        };
        let (columns, rows) = (range(0), range(1));
        let (ux, uy) = (b[0] - a[0], b[1] - a[1]);
        let square = ux * ux + uy * uy;
        for j in rows {
            for i in columns.clone() {
                let px = (self.corner[0] + i) as f32 + 0.5 - a[0];
                let py = (self.corner[1] + j) as f32 + 0.5 - a[1];
                let t = if square > 0.0 {
                    ((px * ux + py * uy) / square).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let distance = (px - t * ux).hypot(py - t * uy);
                let share = (self.half_width + 0.5 - distance).clamp(0.0, 1.0);
                let cell = &mut self.share[j * self.size[0] + i];
                *cell = cell.max(share);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_covers_its_area_once() {
        let mut canvas = Canvas::new(40, 40);
        // A line back and forth, slanted: area is length times width and two half discs.
        canvas.line(
            &[[8.0, 10.0], [30.0, 26.0], [8.0, 10.0]],
            false,
            3.0,
            [0.0; 3],
        );
        let dark: f32 = canvas.pixels.iter().map(|p| 1.0 - p[0]).sum();
        let exact = 22f32.hypot(16.0) * 3.0 + std::f32::consts::PI * 2.25;
        // Coverage by distance is exact for straight edges up to the slant of a pixel.
        assert!((dark / exact - 1.0).abs() < 0.02, "{dark} {exact}");
    }

    #[test]
    fn dashes_go_around_corners_and_have_their_lengths() {
        let corner = [[0.0, 0.0], [5.0, 0.0], [5.0, 20.0]];
        let found = dashes(&corner, [7.0, 4.0]);
        assert_eq!(
            found,
            [
                vec![[0.0, 0.0], [5.0, 0.0], [5.0, 2.0]],
                vec![[5.0, 6.0], [5.0, 13.0]],
                vec![[5.0, 17.0], [5.0, 20.0]],
            ]
        );
        assert!(dashes(&[], [7.0, 4.0]).is_empty());
        // Dashes without length end, too.
        assert_eq!(dashes(&[[f32::NAN; 2], [1.0; 2]], [7.0, 4.0]).len(), 1);
    }

    #[test]
    fn a_ring_is_filled_by_its_area() {
        let circle = |radius: f32| {
            (0..200)
                .map(|k| {
                    let (sin, cos) = (k as f32 * std::f32::consts::TAU / 200.0).sin_cos();
                    [20.3 + radius * cos, 19.6 + radius * sin]
                })
                .collect::<Vec<_>>()
        };
        let mut canvas = Canvas::new(40, 40);
        canvas.fill(&[circle(15.0), circle(7.0)], [0.0; 3]);
        let dark: f32 = canvas.pixels.iter().map(|p| 1.0 - p[0]).sum();
        let exact = std::f32::consts::PI * (225.0 - 49.0);
        // Eight rows a pixel, and polygons of 200 sides.
        assert!((dark / exact - 1.0).abs() < 2e-3, "{dark} {exact}");
        assert_eq!(canvas.pixel(20, 19), WHITE);
    }

    #[test]
    fn a_reduced_picture_has_the_same_mean() {
        let mut canvas = Canvas::new(50, 31);
        canvas.fill(
            &[vec![[5.0, 5.0], [44.0, 8.0], [20.0, 29.0]]],
            [0.1, 0.5, 0.0],
        );
        let mean = |canvas: &Canvas, k: usize| {
            canvas.pixels.iter().map(|p| p[k]).sum::<f32>() / canvas.pixels.len() as f32
        };
        let small = canvas.reduced(17);
        assert_eq!(small.size(), [17, 11]);
        for k in 0..3 {
            // Sums of a thousand numbers in single precision.
            assert!((mean(&small, k) - mean(&canvas, k)).abs() < 1e-4);
        }
        assert_eq!(canvas.reduced(60).size(), [50, 31]);
        let mut page = Canvas::new(50, 31);
        page.fill(
            &[vec![[0.0, 0.0], [50.0, 0.0], [50.0, 31.0], [0.0, 31.0]]],
            [0.5; 3],
        );
        page.overlay(&canvas, [0, 0]);
        // Rounding of the mixing of colours.
        let near = |a: Colour, b: Colour| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-5);
        assert!(near(page.pixel(1, 1), [0.5; 3]));
        assert!(near(page.pixel(21, 12), [0.1, 0.5, 0.0]));
    }

    #[test]
    fn lines_outside_and_strange_ones_are_left_out() {
        let mut canvas = Canvas::new(10, 10);
        canvas.line(&[[-50.0, 3.0], [-20.0, 3.0]], false, 2.0, [0.0; 3]);
        canvas.line(&[[f32::NAN, 3.0], [5.0, 3.0]], false, 2.0, [0.0; 3]);
        canvas.line(&[], true, 2.0, [0.0; 3]);
        assert!(canvas.pixels.iter().flatten().all(|c| c.is_finite()));
        canvas.line(&[[-50.0, 5.0], [50.0, 5.0]], false, 2.0, [0.0; 3]);
        assert_eq!(canvas.pixel(0, 5), [0.0; 3]);
        assert_eq!(canvas.pixel(9, 4), [0.0; 3]);
    }
}
