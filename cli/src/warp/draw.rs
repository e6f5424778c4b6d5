//! `before_and_after.png`: what was carried, where it was and where it is.

use levelset::Contour;
use shapespace_picture::{Camera, Canvas, Colour, INK, Shape, Tiles, colour, tint};

use super::points::Moved;
use shapespace_input::Mesh;

/// The name of the picture.
pub(super) const PICTURE: &str = "before_and_after.png";
/// Pixels of the longer side of a tile.
const SIDE: usize = 320;
/// Space at the border of tiles of points and curves, relative to their longer side.
const MARGIN: f64 = 0.05;
/// Files that are shown.
const SHOWN: usize = 12;

/// A file before and after.
pub(super) type Pair = [Canvas; 2];

/// All pairs, a row for each of the first files.
pub(super) fn sheet(carried: &[Moved]) -> Canvas {
    let mut tiles = Vec::new();
    for moved in carried.iter().take(SHOWN) {
        let Some([before, after]) = &moved.pictures else {
            continue;
        };
        let name = moved.name.display();
        tiles.push((format!("{name}, before"), before.clone()));
        tiles.push(("after".to_owned(), after.clone()));
    }
    Tiles {
        tiles: &tiles,
        columns: 2,
        side: SIDE,
    }
    .draw()
}

/// An image at its samples and at those of the result; of volumes the middle plane.
pub(super) fn images(
    (before, size): (&[f64], [usize; 3]),
    (after, new_size): (&[f32], [usize; 3]),
) -> Pair {
    let finite = || before.iter().copied().filter(|value| value.is_finite());
    let [low, high] = [finite().reduce(f64::min), finite().reduce(f64::max)];
    let range = [low.unwrap_or(0.0), high.unwrap_or(1.0)];
    [
        plane(|index| before[index], size, range),
        plane(|index| f64::from(after[index]), new_size, range),
    ]
}

fn plane(value: impl Fn(usize) -> f64, size: [usize; 3], [low, high]: [f64; 2]) -> Canvas {
    let [nx, ny, nz] = size;
    let longest = nx.max(ny).max(1);
    let [width, height] = [nx, ny].map(|n| (n * SIDE).div_ceil(longest));
    let mut canvas = Canvas::new(width, height);
    let first = nz / 2 * nx * ny;
    for y in 0..height {
        for x in 0..width {
            let sample = [(x, nx), (y, ny)].map(|(x, n)| (x * longest / SIDE).min(n - 1));
            let grey = (value(first + sample[0] + nx * sample[1]) - low) / (high - low);
            let grey = if grey.is_finite() {
                grey.clamp(0.0, 1.0)
            } else {
                0.0
            };
            canvas.blend(x, y, [grey as f32; 3], 1.0);
        }
    }
    canvas
}

/// From the plane of the first two coordinates to the pixels of a tile.
struct Plane {
    low: [f64; 2],
    scale: f64,
}

impl Plane {
    /// A tile around points, and its size.
    fn around(points: impl Iterator<Item = [f64; 2]>) -> (Self, [usize; 2]) {
        let [mut low, mut high] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for p in points.filter(|p| p.iter().all(|x| x.is_finite())) {
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
            }
        }
        let sides = [0, 1].map(|k| (high[k] - low[k]).max(0.0));
        let longest = sides[0].max(sides[1]).max(f64::MIN_POSITIVE);
        let margin = MARGIN * longest;
        let scale = SIDE as f64 / (longest + 2.0 * margin);
        let size = sides.map(|side| ((side + 2.0 * margin) * scale).ceil() as usize);
        let low = low.map(|x| if x.is_finite() { x - margin } else { 0.0 });
        (Self { low, scale }, size.map(|n| n.clamp(1, SIDE)))
    }

    fn pixel(&self, p: [f64; 2]) -> [f32; 2] {
        [0, 1].map(|k| ((p[k] - self.low[k]) * self.scale) as f32)
    }

    fn curve(&self, curve: &[[f64; 2]]) -> Vec<[f32; 2]> {
        curve.iter().map(|p| self.pixel(*p)).collect()
    }
}

fn flat(p: &[f64; 3]) -> [f64; 2] {
    [p[0], p[1]]
}

/// Points, with their ways, in the plane of the first two coordinates.
pub(super) fn points(before: &[[f64; 3]], after: &[[f64; 3]]) -> Pair {
    let (plane, [width, height]) = Plane::around(before.iter().chain(after).map(flat));
    let dot = |canvas: &mut Canvas, p: &[f64; 3], hue: Colour| {
        let [x, y] = plane.pixel(flat(p));
        // A line that is shorter than it is wide has round ends.
        canvas.line(&[[x - 0.05, y], [x + 0.05, y]], false, 5.0, hue);
    };
    let mut pair = [Canvas::new(width, height), Canvas::new(width, height)];
    for p in before {
        dot(&mut pair[0], p, INK);
    }
    for (p, q) in before.iter().zip(after) {
        let way = [plane.pixel(flat(p)), plane.pixel(flat(q))];
        pair[1].line(&way, false, 1.0, tint(INK));
        dot(&mut pair[1], q, colour(0));
    }
    pair
}

/// Closed curves; those before are faintly visible behind those after.
pub(super) fn curves(before: &[Vec<[f64; 2]>], after: &[Vec<[f64; 2]>]) -> Pair {
    let all = before.iter().chain(after).flatten().copied();
    let (plane, [width, height]) = Plane::around(all);
    let mut pair = [Canvas::new(width, height), Canvas::new(width, height)];
    for curve in before {
        pair[0].line(&plane.curve(curve), true, 2.0, INK);
        pair[1].line(&plane.curve(curve), true, 1.0, tint(INK));
    }
    for curve in after {
        pair[1].line(&plane.curve(curve), true, 2.0, colour(0));
    }
    pair
}

/// A surface, seen from one side.
pub(super) fn surfaces(mesh: &Mesh, after: &[[f64; 3]]) -> Option<Pair> {
    let shape = |points: &[[f64; 3]]| {
        let contour = Contour::new(points.to_vec(), mesh.triangles.clone());
        contour.ok().map(|contour| Shape::of(&contour))
    };
    let both = [shape(&mesh.points)?, shape(after)?];
    let camera = Camera::around(&both, SIDE);
    let [before, after] = both;
    Some([
        camera.portrait(&before, INK),
        camera.portrait(&after, colour(0)),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_and_points_lie_where_they_are() {
        let before = [0.0, 1.0, 2.0, 3.0];
        let after = [3.0, 2.0, 1.0, 0.0];
        let [a, b] = images((&before, [2, 2, 1]), (&after, [2, 2, 1]));
        assert_eq!(a.size(), [SIDE; 2]);
        assert_eq!(a.pixel(0, 0), [0.0; 3]);
        assert_eq!(a.pixel(SIDE - 1, SIDE - 1), [1.0; 3]);
        assert_eq!(b.pixel(0, 0), [1.0; 3]);
        let moved = points(
            &[[0.0; 3], [4.0, 2.0, 0.0]],
            &[[4.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
        );
        assert_eq!(moved[0].size()[0], SIDE);
        let dark = |canvas: &Canvas| canvas.pixel(SIDE / 22, SIDE / 22)[0] < 0.5;
        assert!(dark(&moved[0]));
        // Nothing to draw is no error.
        assert_eq!(points(&[], &[])[0].size().len(), 2);
    }
}
