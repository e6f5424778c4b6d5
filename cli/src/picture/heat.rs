//! Colours of numbers: pale to dark by way of yellow and red, on a white page.

use super::{Canvas, Colour, GREY, PALE, mix, text};

/// Colours at equal distances, of falling lightness.
const STOPS: [Colour; 6] = [
    [0.97, 0.95, 0.86],
    [0.98, 0.84, 0.52],
    [0.95, 0.60, 0.28],
    [0.84, 0.33, 0.26],
    [0.58, 0.13, 0.34],
    [0.25, 0.05, 0.32],
];

/// The colour of a share between 0 and 1; numbers beyond have the colour of the nearer end.
pub fn heat(share: f64) -> Colour {
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    // A share that is not a number counts as zero here.
    let stop = (place as usize).min(STOPS.len() - 2);
    mix(STOPS[stop], STOPS[stop + 1], (place - stop as f64) as f32)
}

/// Draws the scale with its ends, in the middle of a line of this width and height of text.
pub(super) fn legend(
    canvas: &mut Canvas,
    title: &str,
    most: f64,
    corner: [usize; 2],
    width: usize,
    height: f32,
) {
    const BAR: usize = 160;
    const SPACE: f32 = 10.0;
    let (first, last) = (format!("{title}  0"), number(most));
    let widths = [text::width(&first, height), text::width(&last, height)];
    let used = widths[0] + widths[1] + BAR as f32 + 2.0 * SPACE;
    let left = corner[0] as f32 + (0.5 * (width as f32 - used)).max(0.0);
    text::draw(canvas, &first, [left, corner[1] as f32], height, GREY);
    let bar = [(left + widths[0] + SPACE) as usize, corner[1]];
    let rows = height as usize + 2;
    for x in 0..BAR {
        let colour = heat((x as f64 + 0.5) / BAR as f64);
        for y in 0..rows {
            canvas.blend(bar[0] + x, bar[1] + y, colour, 1.0);
        }
    }
    canvas.frame(bar, [BAR, rows], PALE);
    let right = (bar[0] + BAR) as f32 + SPACE;
    text::draw(canvas, &last, [right, corner[1] as f32], height, GREY);
}

/// A number of three digits.
pub(super) fn number(value: f64) -> String {
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
    fn larger_numbers_are_darker() {
        let light = |share: f64| {
            let c = heat(share);
            0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
        };
        let mut last = f32::INFINITY;
        for k in 0..=50 {
            let now = light(f64::from(k) / 50.0);
            assert!(now < last, "{k}");
            last = now;
        }
        assert_eq!(heat(-1.0), heat(0.0));
        assert_eq!(heat(7.0), heat(1.0));
        assert!(heat(f64::NAN).iter().all(|c| c.is_finite()) || heat(f64::NAN)[0].is_nan());
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
