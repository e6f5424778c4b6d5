//! What markers and their colours mean, in a line under a picture.

use super::text::SIZE;
use super::{Canvas, GREY, Marker, colour, text};

/// A category and its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// The name.
    pub name: String,
    /// The number of the category, which has the marker and the colour of it.
    pub category: usize,
}

/// Height of a line.
const LINE: usize = 20;
/// Longest name.
const MOST: f32 = 140.0;
/// Space after a marker, and after a name.
pub(crate) const SPACES: [f32; 2] = [5.0, 22.0];

/// Lines of keys for a picture of this width: places of the markers.
fn places(keys: &[Key], width: usize) -> Vec<[usize; 2]> {
    let (mut x, mut y) = (0.0, 0);
    let mut found = Vec::with_capacity(keys.len());
    for key in keys {
        let used = SIZE + SPACES[0] + text::width(&shown(key), SIZE);
        if x > 0.0 && x + used > width as f32 {
            (x, y) = (0.0, y + LINE);
        }
        found.push([x as usize, y]);
        x += used + SPACES[1];
    }
    found
}

fn shown(key: &Key) -> String {
    text::shortened(&key.name, SIZE, MOST)
}

/// Height that the keys take.
pub(crate) fn height(keys: &[Key], width: usize) -> usize {
    places(keys, width).last().map_or(0, |[_, y]| y + LINE)
}

/// Draws the keys from their upper left corner.
pub(crate) fn draw(canvas: &mut Canvas, keys: &[Key], corner: [usize; 2], width: usize) {
    for (key, [x, y]) in keys.iter().zip(places(keys, width)) {
        let [left, top] = [corner[0] + x, corner[1] + y];
        let middle = [left as f32 + 0.5 * SIZE, top as f32 + 0.5 * SIZE];
        mark(canvas, key.category, middle);
        let at = [left as f32 + SIZE + SPACES[0], top as f32];
        text::draw(canvas, &shown(key), at, SIZE, GREY);
    }
}

/// Draws the marker of a category, about as high as the text.
pub(crate) fn mark(canvas: &mut Canvas, category: usize, [x, y]: [f32; 2]) {
    let outline = Marker::of(category).outline(0.47 * SIZE);
    let placed = outline.iter().map(|p| [x + p[0], y + p[1]]).collect();
    canvas.fill(&[placed], colour(category));
}

/// Draws the marker of a category and a name beside it, together centred on a point at the upper
/// edge of the text.
pub(crate) fn centred(
    canvas: &mut Canvas,
    category: usize,
    name: &str,
    middle: [f32; 2],
    most: f32,
) {
    let used = SIZE + SPACES[0];
    let name = text::shortened(name, text::SMALL, most - used);
    let left = (middle[0] - 0.5 * (used + text::width(&name, text::SMALL))).round();
    mark(
        canvas,
        category,
        [left + 0.5 * SIZE, middle[1] + 0.5 * SIZE],
    );
    let corner = [left + used, middle[1] + 0.5 * (SIZE - text::SMALL)];
    text::draw(canvas, &name, corner, text::SMALL, GREY);
}

/// Draws the marker of a category and a name before it, both ending at a point in the middle of
/// the text.
pub(crate) fn before(
    canvas: &mut Canvas,
    category: usize,
    name: &str,
    [x, y]: [f32; 2],
    most: f32,
) {
    mark(canvas, category, [x - 0.5 * SIZE, y]);
    let used = SIZE + SPACES[0];
    let name = text::shortened(name, SIZE, most - used);
    let start = x - used - text::width(&name, SIZE);
    text::draw(canvas, &name, [start, y - 0.5 * SIZE], SIZE, GREY);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_go_on_in_the_next_line() {
        let keys: Vec<Key> = (0..9)
            .map(|i| Key {
                name: format!("class {i}"),
                category: i,
            })
            .collect();
        let found = places(&keys, 300);
        assert_eq!((found[0], found[1][1]), ([0, 0], 0));
        assert!(found[8][1] >= LINE);
        assert!(found.iter().all(|[x, _]| *x < 300));
        assert_eq!(height(&keys, 300), found[8][1] + LINE);
        assert_eq!(height(&[], 300), 0);
    }
}
