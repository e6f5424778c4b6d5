//! Flat shapes in a part of the unit box.

use super::{Canvas, Colour, Curve, WHITE};

/// A rectangle of the unit box as a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Its corner where both coordinates are least.
    low: [f64; 2],
    /// Pixels of one unit.
    scale: f64,
    /// Pixels along `x` and `y`.
    size: [usize; 2],
}

/// Room around the shapes, as a share of their longer side.
const MARGIN: f64 = 0.07;
/// Largest ratio of the sides.
const MOST_SLENDER: f64 = 2.5;

impl Window {
    /// Shows all these curves in a picture of this width.
    pub fn around<'a>(curves: impl IntoIterator<Item = &'a Curve>, width: usize) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in curves.into_iter().flat_map(|curve| &curve.points) {
            for k in 0..2 {
                low[k] = low[k].min(point[k]);
                high[k] = high[k].max(point[k]);
            }
        }
        // No curve, or a single point.
        let visible = low[0] <= high[0] && low[1] <= high[1];
        if !visible || (high[0] - low[0]).max(high[1] - low[1]) < 1e-6 {
            (low, high) = ([0.0; 2], [1.0; 2]);
        }
        let sides = [0, 1].map(|k| high[k] - low[k]);
        let longest = sides[0].max(sides[1]);
        let sides = sides.map(|side| side.max(longest / MOST_SLENDER) + 2.0 * MARGIN * longest);
        let scale = width as f64 / sides[0];
        Self {
            low: [0, 1].map(|k| 0.5 * (low[k] + high[k]) - 0.5 * sides[k]),
            scale,
            size: [width, (scale * sides[1]).round().max(1.0) as usize],
        }
    }

    /// The same part of the box in a picture with this number of pixels along its longer side.
    pub fn with_longer_side(self, pixels: usize) -> Self {
        let factor = pixels as f64 / self.size[0].max(self.size[1]) as f64;
        Self {
            scale: factor * self.scale,
            size: self
                .size
                .map(|n| ((factor * n as f64).round() as usize).max(1)),
            ..self
        }
    }

    /// Pixels along `x` and `y`.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// A white picture of this size.
    pub fn canvas(&self) -> Canvas {
        Canvas::new(self.size[0], self.size[1])
    }

    /// Fills the points inside an odd number of curves.
    pub fn fill(&self, canvas: &mut Canvas, curves: &[Curve], colour: Colour) {
        let curves: Vec<_> = curves.iter().map(|curve| self.pixels(curve)).collect();
        canvas.fill(&curves, colour);
    }

    /// Draws curves.
    pub fn outline(&self, canvas: &mut Canvas, curves: &[Curve], width: f32, colour: Colour) {
        for curve in curves {
            canvas.line(&self.pixels(curve), curve.closed, width, colour);
        }
    }

    /// Gives every point inside an odd number of curves a colour of its own.
    pub fn paint(
        &self,
        canvas: &mut Canvas,
        curves: &[Curve],
        colour: impl Fn([f64; 2]) -> Colour,
    ) {
        let mut cover = self.canvas();
        self.fill(&mut cover, curves, [0.0; 3]);
        for y in 0..self.size[1] {
            for x in 0..self.size[0] {
                let share = WHITE[0] - cover.pixel(x, y)[0];
                if share > 0.0 {
                    let point = [0, 1].map(|k| self.low[k] + ([x, y][k] as f64 + 0.5) / self.scale);
                    canvas.blend(x, y, colour(point), share);
                }
            }
        }
    }

    fn pixels(&self, curve: &Curve) -> Vec<[f32; 2]> {
        let place = |p: &[f64; 2]| [0, 1].map(|k| (self.scale * (p[k] - self.low[k])) as f32);
        curve.points.iter().map(place).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64) -> Curve {
        Curve {
            points: vec![[low, low], [high, low], [high, high], [low, high]],
            closed: true,
        }
    }

    #[test]
    fn shapes_fill_their_window() {
        let curves = [square(0.3, 0.5)];
        let window = Window::around(&curves, 114);
        assert_eq!(window.size(), [114, 114]);
        let mut canvas = window.canvas();
        window.paint(&mut canvas, &curves, |p| [p[0] as f32, p[1] as f32, 0.0]);
        // Seven pixels of room, then the square, whose colours are its coordinates.
        assert_eq!(canvas.pixel(5, 50), WHITE);
        assert!((canvas.pixel(57, 20)[0] - 0.4).abs() < 0.002);
        assert!((canvas.pixel(57, 20)[1] - 0.327).abs() < 0.002);
        assert_eq!(window.with_longer_side(57).size(), [57, 57]);
    }

    #[test]
    fn strange_shapes_have_a_window_too() {
        assert_eq!(Window::around(&[], 50).size(), [50, 50]);
        let line = Curve {
            points: vec![[0.1, 0.5], [0.9, 0.5]],
            closed: false,
        };
        let [width, height] = Window::around(&[line], 100).size();
        assert_eq!(width, 100);
        assert!((40..60).contains(&height), "{height}");
    }
}
