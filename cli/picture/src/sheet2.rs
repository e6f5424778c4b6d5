//! The picture of a flat average: the inputs, the average, and the warped inputs over it.

use super::{
    Canvas, Colour, Curve, GAP, GREY, INK, LABEL, PALE, Rows, Shape, WHITE, colour, dashes, mix,
    text,
};

const WIDTH: usize = 920;
const MOST_TILE: usize = 300;

/// A shape to be shown in one tile.
#[derive(Clone, Copy, Debug)]
pub struct ShapeTile<'a> {
    /// Text under the tile.
    pub label: &'a str,
    /// Its boundary; the object consists of the points inside an odd number of these curves.
    pub outline: &'a [Curve],
    /// The boundaries of its components, each in a colour of its own; none of a shape of one.
    pub parts: &'a [Shape],
}

/// Everything in the picture of a flat average.
#[derive(Clone, Copy, Debug)]
pub struct ContactSheet<'a> {
    /// The inputs.
    pub inputs: &'a [ShapeTile<'a>],
    /// The average.
    pub average: ShapeTile<'a>,
    /// The outlines of the inputs warped onto the average, each with the number of its colour.
    pub warped: &'a [(Shape, usize)],
    /// Sides of the box in which all these lie.
    pub sides: [f64; 2],
}

impl ContactSheet<'_> {
    /// Draws the picture.
    pub fn draw(&self) -> Canvas {
        let inner = WIDTH - 2 * GAP;
        let rows = Rows::fill(self.inputs.len(), inner, MOST_TILE);
        let low = self.height(rows.tile);
        let rows = rows.of_height(low);
        let large = (inner - GAP) / 2;
        let height = GAP + rows.height() + self.height(large) + LABEL + GAP;
        let mut canvas = Canvas::new(WIDTH, height);
        for (i, input) in self.inputs.iter().enumerate() {
            let [x, y] = rows.corner(i, inner);
            let tile = self.tile([GAP + x, GAP + y], rows.tile);
            let line = (rows.tile as f32 / 150.0).clamp(1.2, 2.0);
            if input.parts.is_empty() {
                tile.fill(&mut canvas, input.outline, mix(WHITE, colour(i), 0.28));
                tile.category(&mut canvas, input.outline, line, i);
            }
            tile.parts(&mut canvas, input.parts, line);
            tile.finish(&mut canvas, input.label);
        }
        let y = GAP + rows.height();
        let fill = mix(WHITE, INK, 0.22);
        let average = self.tile([GAP, y], large);
        average.fill(&mut canvas, self.average.outline, fill);
        average.curves(&mut canvas, self.average.outline, 2.2, INK);
        average.parts(&mut canvas, self.average.parts, 2.2);
        average.finish(&mut canvas, self.average.label);
        let over = self.tile([GAP + large + GAP, y], large);
        over.fill(&mut canvas, self.average.outline, mix(WHITE, INK, 0.10));
        for (shape, category) in self.warped {
            over.category(&mut canvas, shape.curves(), 1.6, *category);
        }
        over.finish(&mut canvas, "inputs warped onto the average");
        canvas
    }

    /// Pixels of one unit of a tile of this width.
    fn scale(&self, width: usize) -> f64 {
        width as f64 / f64::max(self.sides[0], self.sides[1])
    }

    /// The height of a tile of this width: lower for a flat box.
    fn height(&self, width: usize) -> usize {
        ((self.scale(width) * self.sides[1]).round() as usize).max(1)
    }

    fn tile(&self, corner: [usize; 2], width: usize) -> Tile {
        let scale = self.scale(width);
        let beside = 0.5 * (width as f64 - scale * self.sides[0]);
        Tile {
            origin: [corner[0] as f64 + beside, corner[1] as f64].map(|x| x as f32),
            scale: scale as f32,
            corner,
            size: [width, self.height(width)],
        }
    }
}

/// The box on the canvas.
struct Tile {
    corner: [usize; 2],
    size: [usize; 2],
    /// Where the origin of the box is.
    origin: [f32; 2],
    scale: f32,
}

impl Tile {
    fn fill(&self, canvas: &mut Canvas, curves: &[Curve], fill: Colour) {
        let curves: Vec<_> = curves.iter().map(|curve| self.pixels(curve)).collect();
        canvas.fill(&curves, fill);
    }

    fn curves(&self, canvas: &mut Canvas, curves: &[Curve], width: f32, colour: Colour) {
        for curve in curves {
            canvas.line(&self.pixels(curve), curve.closed, width, colour);
        }
    }

    /// Fills the components of a shape, each in its colour.
    fn parts(&self, canvas: &mut Canvas, parts: &[Shape], line: f32) {
        for (category, part) in parts.iter().enumerate() {
            self.fill(canvas, part.curves(), mix(WHITE, colour(category), 0.28));
            self.category(canvas, part.curves(), line, category);
        }
    }

    /// Draws curves in the colour and the dashes of a category.
    fn category(&self, canvas: &mut Canvas, curves: &[Curve], width: f32, category: usize) {
        let Some(lengths) = dashes(category) else {
            return self.curves(canvas, curves, width, colour(category));
        };
        for curve in curves {
            let points = self.pixels(curve);
            canvas.dashed(&points, curve.closed, lengths, width, colour(category));
        }
    }

    fn pixels(&self, curve: &Curve) -> Vec<[f32; 2]> {
        curve
            .points
            .iter()
            .map(|p| std::array::from_fn(|k| self.origin[k] + p[k] as f32 * self.scale))
            .collect()
    }

    fn finish(&self, canvas: &mut Canvas, label: &str) {
        canvas.frame(self.corner, self.size, PALE);
        let side = self.size[0] as f32;
        let middle = [
            self.corner[0] as f32 + 0.5 * side,
            (self.corner[1] + self.size[1] + 8) as f32,
        ];
        text::centred(canvas, label, middle, text::SIZE, side, GREY);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shapespace_generate::{Letter, Outline, letter};

    fn curves(outline: &Outline) -> Vec<Curve> {
        outline
            .curves()
            .iter()
            .map(|points| Curve {
                points: points.iter().map(|p| p.map(|x| x + 0.5)).collect(),
                closed: true,
            })
            .collect()
    }

    /// Set `SHAPESPACE_PICTURES` to a folder to look at the picture.
    fn keep(canvas: &Canvas, name: &str) {
        if let Ok(folder) = std::env::var("SHAPESPACE_PICTURES") {
            canvas
                .write_png(&std::path::Path::new(&folder).join(name))
                .unwrap();
        }
    }

    #[test]
    fn every_shape_has_its_tile_in_its_colour() {
        let which = [
            Letter::A,
            Letter::B,
            Letter::SerifB,
            Letter::LightB,
            Letter::C,
            Letter::M,
            Letter::O,
            Letter::U,
            Letter::X,
        ];
        let outlines: Vec<Outline> = which.iter().map(|&l| letter(l)).collect();
        let lines: Vec<_> = outlines.iter().map(curves).collect();
        let numbered = lines.iter().cloned().zip(0..);
        let warped: Vec<_> = numbered.map(|(c, i)| (Shape::Flat(c), i)).collect();
        let names: Vec<String> = (0..9).map(|i| format!("letter_{i:03}.npy")).collect();
        let inputs: Vec<_> = (0..9)
            .map(|i| ShapeTile {
                label: &names[i],
                outline: &lines[i],
                parts: &[],
            })
            .collect();
        let sheet = ContactSheet {
            inputs: &inputs,
            average: ShapeTile {
                label: "average",
                outline: &lines[1],
                parts: &[],
            },
            warped: &warped,
            sides: [1.0; 2],
        };
        let canvas = sheet.draw();
        keep(&canvas, "sheet2.png");
        let two = ContactSheet {
            inputs: &inputs[1..3],
            warped: &warped[..2],
            ..sheet
        };
        keep(&two.draw(), "sheet2_two.png");
        // The stem of the B, second tile: its fill is a tint of its colour.
        let rows = Rows::fill(9, WIDTH - 2 * GAP, MOST_TILE);
        let [x, y] = rows.corner(1, WIDTH - 2 * GAP);
        let stem = canvas.pixel(
            GAP + x + (0.32 * rows.tile as f64) as usize,
            GAP + y + rows.tile / 2,
        );
        let tint = mix(WHITE, colour(1), 0.28);
        assert!(
            (0..3).all(|k| (stem[k] - tint[k]).abs() < 1e-5),
            "{stem:?} {tint:?}"
        );
        let flat = ContactSheet {
            sides: [1.0, 0.8],
            ..sheet
        };
        // Two rows of tiles, and the large ones.
        let lost = |width: usize| width - (0.8 * width as f64).round() as usize;
        let lower = canvas.size()[1] - flat.draw().size()[1];
        assert_eq!(lower, 2 * lost(rows.tile) + lost((WIDTH - 3 * GAP) / 2));
        // The stem of the average, and the space beside it.
        let [w, h] = canvas.size();
        let parted = ContactSheet {
            average: ShapeTile {
                parts: &[Shape::Flat(lines[1].clone())],
                ..sheet.average
            },
            ..sheet
        };
        let [red, _, blue] = parted.draw().pixel(w / 4 - 60, h - 240);
        assert!((red - blue).abs() > 0.05, "{red} {blue}");
        assert!(canvas.pixel(w / 4 - 60, h - 240)[0] < 0.9);
        assert!(canvas.pixel(w / 4 - 200, h - 240)[0] == 1.0);
    }
}
