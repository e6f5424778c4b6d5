//! The picture of an analogy: four shapes, of which the fourth is to the third as the second is to
//! the first.

use super::film::place;
use super::{Canvas, GAP, LABEL};

/// Tiles in two rows, first and second above, third and fourth below.
pub fn analogy(names: &[String; 4], tiles: &[Canvas]) -> Canvas {
    let side = tiles.first().map_or([1; 2], Canvas::size);
    let pitch = [side[0] + GAP, side[1] + LABEL + GAP];
    let mut canvas = Canvas::new(GAP + 2 * pitch[0], GAP + 2 * pitch[1]);
    for (k, (name, tile)) in names.iter().zip(tiles).enumerate() {
        let corner = [GAP + (k % 2) * pitch[0], GAP + (k / 2) * pitch[1]];
        place(&mut canvas, tile, corner, name);
    }
    canvas
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_tiles_stand_in_two_rows() {
        let tiles = vec![Canvas::new(200, 90); 4];
        let names = ["a", "b", "c", "d"].map(String::from);
        let found = analogy(&names, &tiles).size();
        assert!(found[0] > 400 && found[1] > 180, "{found:?}");
    }
}
