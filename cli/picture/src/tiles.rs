//! Pictures of one size in rows, each with its name.

use super::Canvas;
use super::film::place;

/// Space at the border and between tiles.
const SPACE: usize = 14;
/// Height of the line of text under a tile.
const LABEL: usize = 22;

/// Named pictures in rows.
#[derive(Clone, Copy, Debug)]
pub struct Tiles<'a> {
    /// Names and pictures, row by row.
    pub tiles: &'a [(String, Canvas)],
    /// Pictures in a row.
    pub columns: usize,
    /// Longer side of a tile; larger pictures are reduced to it.
    pub side: usize,
}

impl Tiles<'_> {
    /// Draws them on one canvas.
    pub fn draw(&self) -> Canvas {
        let reduced: Vec<Canvas> = self
            .tiles
            .iter()
            .map(|(_, p)| p.reduced(self.side))
            .collect();
        let tile = reduced.iter().fold([1; 2], |size: [usize; 2], picture| {
            let own = picture.size();
            [size[0].max(own[0]), size[1].max(own[1])]
        });
        let columns = self.columns.max(1);
        let rows = reduced.len().div_ceil(columns);
        let pitch = [tile[0] + SPACE, tile[1] + LABEL + SPACE];
        let shown = columns.min(reduced.len().max(1));
        let mut canvas = Canvas::new(SPACE + shown * pitch[0], SPACE + rows * pitch[1]);
        for (k, (picture, (name, _))) in reduced.iter().zip(self.tiles).enumerate() {
            let corner = [
                SPACE + k % columns * pitch[0],
                SPACE + k / columns * pitch[1],
            ];
            place(&mut canvas, picture, corner, name);
        }
        canvas
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_has_its_place() {
        let mut tile = Canvas::new(100, 60);
        tile.blend(50, 30, [0.0, 0.0, 1.0], 1.0);
        let tiles = vec![("a name".to_string(), tile); 5];
        let sheet = Tiles {
            tiles: &tiles,
            columns: 3,
            side: 100,
        };
        let canvas = sheet.draw();
        let [width, height] = canvas.size();
        assert_eq!([width, height], [14 + 3 * 114, 14 + 2 * 96]);
        let blue = (0..width * height)
            .filter(|i| canvas.pixel(i % width, i / width) == [0.0, 0.0, 1.0])
            .count();
        assert_eq!(blue, 5);
    }
}
