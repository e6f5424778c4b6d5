//! The scale of the colours of numbers.

use super::{Canvas, Colour, GREY, PALE, heat, text};
use shapespace_report::chart::round_above;

/// What the colours of a picture mean: a bar with labels.
#[derive(Clone, Debug)]
pub struct ColourBar {
    /// What is shown, with its unit.
    pub title: String,
    /// The colour at a share of the bar.
    pub colour: fn(f64) -> Colour,
    /// Shares of the bar, with their labels.
    pub marks: Vec<(f64, String)>,
}

impl ColourBar {
    /// The bar of a range of numbers, with labels at round ones.
    pub fn linear(
        title: impl Into<String>,
        [low, high]: [f64; 2],
        colour: fn(f64) -> Colour,
    ) -> Self {
        const LABELS: f64 = 5.0;
        let step = round_above((high - low) / LABELS);
        let marks = if step.is_normal() && high > low {
            let digits = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
            let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
            let mark = |k: i64| {
                let value = step * k as f64;
                ((value - low) / (high - low), format!("{value:.digits$}"))
            };
            (first..=last).map(mark).collect()
        } else {
            vec![(0.0, number(low))]
        };
        Self {
            title: title.into(),
            colour,
            marks,
        }
    }

    /// A picture of this width, without the title.
    pub fn draw(&self, width: usize) -> Canvas {
        const HEIGHT: usize = 14;
        const TICK: usize = 4;
        let side = width as f64 - 1.0;
        let mut canvas = Canvas::new(width, HEIGHT + TICK + text::SIZE as usize + 6);
        for x in 0..width {
            for y in 0..HEIGHT {
                canvas.blend(x, y, (self.colour)(x as f64 / side.max(1.0)), 1.0);
            }
        }
        for (share, label) in &self.marks {
            let x = (share.clamp(0.0, 1.0) * side).round();
            for y in HEIGHT..HEIGHT + TICK {
                canvas.blend(x as usize, y, GREY, 1.0);
            }
            let half = 0.5 * text::width(label, text::SMALL) + 2.0;
            let middle = (x as f32).min(width as f32 - half).max(half);
            let top = (HEIGHT + TICK + 3) as f32;
            let most = width as f32;
            text::centred(&mut canvas, label, [middle, top], text::SMALL, most, GREY);
        }
        canvas
    }
}

/// Draws the scale with its ends, in the middle of a line of this width.
pub(crate) fn legend(
    canvas: &mut Canvas,
    title: &str,
    most: f64,
    corner: [usize; 2],
    width: usize,
) {
    const BAR: usize = 160;
    const SPACE: f32 = 10.0;
    let (first, last) = (format!("{title}  0"), number(most));
    let widths = [
        text::width(&first, text::SIZE),
        text::width(&last, text::SIZE),
    ];
    let used = widths[0] + widths[1] + BAR as f32 + 2.0 * SPACE;
    let left = corner[0] as f32 + (0.5 * (width as f32 - used)).max(0.0);
    text::draw(canvas, &first, [left, corner[1] as f32], text::SIZE, GREY);
    let bar = [(left + widths[0] + SPACE) as usize, corner[1]];
    let rows = text::SIZE as usize + 2;
    for x in 0..BAR {
        let colour = heat((x as f64 + 0.5) / BAR as f64);
        for y in 0..rows {
            canvas.blend(bar[0] + x, bar[1] + y, colour, 1.0);
        }
    }
    canvas.frame(bar, [BAR, rows], PALE);
    let right = (bar[0] + BAR) as f32 + SPACE;
    text::draw(canvas, &last, [right, corner[1] as f32], text::SIZE, GREY);
}

/// A number of three digits.
pub(crate) fn number(value: f64) -> String {
    if (1e-2..1e4).contains(&value.abs()) {
        let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 4.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.2e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_have_labels_at_round_numbers() {
        let bar = ColourBar::linear("length (mm)", [0.0, 2.4], heat);
        let labels: Vec<&str> = bar.marks.iter().map(|(_, label)| label.as_str()).collect();
        assert_eq!(labels, ["0.0", "0.5", "1.0", "1.5", "2.0"]);
        assert!((bar.marks[2].0 - 1.0 / 2.4).abs() < 1e-12);
        let picture = bar.draw(200);
        assert_eq!(picture.size()[0], 200);
        // Blending rounds in single precision.
        let near = |pixel: Colour, colour: Colour| {
            let mut pairs = pixel.iter().zip(colour);
            pairs.all(|(a, b)| (a - b).abs() <= 2.0 * f32::EPSILON)
        };
        assert!(near(picture.pixel(0, 0), heat(0.0)));
        assert!(near(picture.pixel(199, 5), heat(1.0)));
        let small = ColourBar::linear("", [0.88, 1.13], heat).marks;
        assert_eq!(small[0].1, "0.90");
        // Nothing varies, or nothing is known.
        for range in [[1.0, 1.0], [0.0, f64::NAN], [0.0, f64::INFINITY]] {
            assert_eq!(ColourBar::linear("", range, heat).marks.len(), 1);
        }
    }

    #[test]
    fn numbers_have_three_digits() {
        let found = [0.0123456, 1.0, 12.345, 1234.5, 1.5e-5, 2e7].map(number);
        assert_eq!(
            found,
            ["0.0123", "1.00", "12.3", "1234", "1.50e-5", "2.00e7"]
        );
    }
}
