//! The picture of an average in space: three large views of it over one view of each input.

use fe_grid::parallel;

use super::film::place;
use super::{Bounds, Canvas, Colour, GAP, LABEL, PaintedSurface, Rows, View, colour, solid};

const WIDTH: usize = 1080;
const MOST_TILE: usize = 240;
/// Height of the eye, in degrees.
const ELEVATION: f64 = 22.0;
/// Warm stone: neutral between the inputs' colours.
const STONE: Colour = [0.80, 0.77, 0.72];

/// Everything in the picture of an average in space. Shapes of one component have no colours of their own.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceSheet<'a> {
    /// The inputs with their names.
    pub inputs: &'a [(&'a str, PaintedSurface<'a>)],
    /// The average.
    pub average: PaintedSurface<'a>,
}

impl SurfaceSheet<'_> {
    /// Draws the picture. The average is shown first from its broad side, and so are the inputs,
    /// which all have one scale.
    pub fn draw(&self) -> Canvas {
        let inner = WIDTH - 2 * GAP;
        let large = (inner - 2 * GAP) / 3;
        let rows = Rows::fill(self.inputs.len(), inner, MOST_TILE);
        let top = GAP + large + LABEL + GAP;
        let mut canvas = Canvas::new(WIDTH, top + rows.height());
        let front = View::broadside(self.average.surface, ELEVATION);
        let above = View {
            elevation: 78.0,
            ..front
        };
        let views = [
            (front, "average"),
            (front.turned(90.0), "from the right"),
            (above, "from above"),
        ];
        for (k, (view, label)) in views.into_iter().enumerate() {
            let corner = [GAP + k * (large + GAP), GAP];
            let average = self.average.surface;
            let bounds = Bounds::around(view, [average]);
            let picture = average.render(view, bounds, self.average.paint(STONE), large);
            place(&mut canvas, &picture, corner, label);
        }
        let inputs = self.inputs.iter().map(|(_, painted)| painted.surface);
        let bounds = Bounds::around(front, inputs);
        let tiles = parallel::map(self.inputs.iter().enumerate(), &|(i, (_, painted))| {
            let paint = painted.paint(solid(colour(i)));
            painted.surface.render(front, bounds, paint, rows.tile)
        });
        for (i, ((label, _), picture)) in self.inputs.iter().zip(&tiles).enumerate() {
            let [x, y] = rows.corner(i, inner);
            place(&mut canvas, picture, [GAP + x, top + y], label);
        }
        canvas
    }
}

#[cfg(test)]
mod tests {
    use super::super::Surface;
    use super::super::mesh::tests::star_surface;
    use super::*;

    #[test]
    fn every_tile_shows_its_surface() {
        let lobes = |a: f64| {
            move |d: [f64; 3]| {
                0.24 * (1.0 + a * (3.0 * d[0] + 1.0).sin() * (2.0 * d[1]).cos() + 0.2 * d[2])
            }
        };
        let meshes: Vec<_> = [0.1, 0.3, 0.5, -0.3]
            .map(|a| star_surface(lobes(a), 60))
            .into();
        let surfaces: Vec<Surface> = meshes
            .iter()
            .map(|(vertices, triangles)| Surface {
                vertices,
                triangles,
            })
            .collect();
        let inputs: Vec<_> = surfaces[1..]
            .iter()
            .map(|s| ("blob.nii.gz", PaintedSurface::plain(*s)))
            .collect();
        let canvas = SurfaceSheet {
            inputs: &inputs,
            average: PaintedSurface::plain(surfaces[0]),
        }
        .draw();
        if let Ok(folder) = std::env::var("SHAPESPACE_PICTURES") {
            canvas
                .write_png(&std::path::Path::new(&folder).join("sheet3.png"))
                .unwrap();
        }
        let large = (WIDTH - 4 * GAP) / 3;
        for k in 0..3 {
            let middle = canvas.pixel(GAP + k * (large + GAP) + large / 2, GAP + large / 2);
            assert!(middle != [1.0; 3]);
            // The corner of a tile is white.
            assert_eq!(canvas.pixel(GAP + k * (large + GAP) + 3, GAP + 3), [1.0; 3]);
        }
    }
}
