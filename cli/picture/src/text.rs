//! Labels on pictures.

pub(crate) use shapespace_report::font::{SIZE, SMALL, shortened, width};

use super::{Canvas, Colour};
use shapespace_report::font;

/// Draws a text from the upper left corner of its capitals.
pub(crate) fn draw(canvas: &mut Canvas, text: &str, corner: [f32; 2], height: f32, colour: Colour) {
    font::cover(text, corner, height, |[x, y], share| {
        canvas.blend(x, y, colour, share);
    });
}

/// Draws a text centred on a point at the upper edge of the capitals, shortened to a width.
pub(crate) fn centred(
    canvas: &mut Canvas,
    text: &str,
    middle: [f32; 2],
    height: f32,
    most: f32,
    colour: Colour,
) {
    let text = shortened(text, height, most);
    let left = (middle[0] - 0.5 * width(&text, height)).round();
    draw(canvas, &text, [left, middle[1]], height, colour);
}
