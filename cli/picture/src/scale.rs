//! The scale of the colours of numbers.

use super::{Canvas, GREY, PALE, heat, text};

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
    fn numbers_have_three_digits() {
        let found = [0.0123456, 1.0, 12.345, 1234.5, 1.5e-5, 2e7].map(number);
        assert_eq!(
            found,
            ["0.0123", "1.00", "12.3", "1234", "1.50e-5", "2.00e7"]
        );
    }
}
