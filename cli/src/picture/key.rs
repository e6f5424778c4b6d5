//! What colours mean, in a line under a picture.

use super::{Canvas, Colour, GREY, text};

/// A colour and its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// The name.
    pub name: String,
    /// The colour.
    pub colour: Colour,
}

/// Height of the text and of the squares.
const TEXT: f32 = 9.0;
/// Height of a line.
const LINE: usize = 20;
/// Longest name.
const MOST: f32 = 140.0;
/// Space after a square, and after a name.
const SPACES: [f32; 2] = [6.0, 22.0];

/// Lines of keys for a picture of this width: places of the squares.
fn places(keys: &[Key], width: usize) -> Vec<[usize; 2]> {
    let (mut x, mut y) = (0.0, 0);
    let mut found = Vec::with_capacity(keys.len());
    for key in keys {
        let used = TEXT + SPACES[0] + text::width(&shown(key), TEXT);
        if x > 0.0 && x + used > width as f32 {
            (x, y) = (0.0, y + LINE);
        }
        found.push([x as usize, y]);
        x += used + SPACES[1];
    }
    found
}

fn shown(key: &Key) -> String {
    text::shortened(&key.name, TEXT, MOST)
}

/// Height that the keys take.
pub(super) fn height(keys: &[Key], width: usize) -> usize {
    places(keys, width).last().map_or(0, |[_, y]| y + LINE)
}

/// Draws the keys from their upper left corner.
pub(super) fn draw(canvas: &mut Canvas, keys: &[Key], corner: [usize; 2], width: usize) {
    for (key, [x, y]) in keys.iter().zip(places(keys, width)) {
        let [left, top] = [corner[0] + x, corner[1] + y];
        for j in 0..=TEXT as usize {
            for i in 0..=TEXT as usize {
                canvas.blend(left + i, top + j, key.colour, 1.0);
            }
        }
        let at = [left as f32 + TEXT + SPACES[0], top as f32];
        text::draw(canvas, &shown(key), at, TEXT, GREY);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_go_on_in_the_next_line() {
        let keys: Vec<Key> = (0..9)
            .map(|i| Key {
                name: format!("class {i}"),
                colour: [0.0; 3],
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
