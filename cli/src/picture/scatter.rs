//! A map of objects, each drawn at its point.

use super::text::SIZE;
use super::tree::round_below;
use super::{Canvas, GREY, Key, key, scale, text};

/// Width of the picture.
const WIDTH: usize = 1100;
/// Least and greatest height of the map, as shares of its width.
const SLENDER: [f64; 2] = [0.4, 1.0];
const BORDER: usize = 18;
/// Least and greatest side of a mark.
const MARKS: [f64; 2] = [48.0, 110.0];
/// Height of the line with the scale.
const LINE: usize = 40;
/// The scale is about this share of the width.
const SCALE: f64 = 0.12;
/// Most objects that have their names.
const MOST_NAMES: usize = 60;

/// Everything in a map.
#[derive(Clone, Copy, Debug)]
pub struct ScatterPlot<'a> {
    /// The points.
    pub points: &'a [[f64; 2]],
    /// What is drawn there, all of one size.
    pub marks: &'a [Canvas],
    /// The labels below the marks.
    pub names: &'a [String],
    /// The numbers of their groups, which have the markers of them.
    pub groups: &'a [usize],
    /// What the markers mean.
    pub key: &'a [Key],
    /// The title.
    pub title: &'a str,
    /// The unit of lengths.
    pub unit: &'a str,
}

impl ScatterPlot<'_> {
    /// Pixels of the longer side of a mark at these points, so that three in four have about as much
    /// room to their nearest neighbour.
    pub fn mark_side(points: &[[f64; 2]]) -> usize {
        let distance = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let mut nearest: Vec<f64> = (0..points.len())
            .map(|i| {
                let others = points.iter().enumerate().filter(|(j, _)| *j != i);
                others.fold(f64::INFINITY, |d, (_, q)| d.min(distance(&points[i], q)))
            })
            .collect();
        nearest.sort_by(f64::total_cmp);
        let (_, sides) = extent(points);
        let near = nearest.get(points.len() / 4).copied().unwrap_or(0.0);
        let share = near / sides[0].max(sides[1]);
        // All points in one place have no sides; a single one is far from all others.
        let pixels = WIDTH as f64 * if share.is_nan() { 0.0 } else { share };
        pixels.clamp(MARKS[0], MARKS[1]) as usize
    }

    /// Draws the map at one scale along both axes, the second axis upwards.
    pub fn draw(&self) -> Canvas {
        let mark = self.marks.first().map_or([1; 2], Canvas::size);
        let room = [mark[0] + 2 * BORDER, mark[1] + 2 * BORDER + SIZE as usize];
        let (low, sides) = extent(self.points);
        let across = (WIDTH - room[0]) as f64;
        // A map that is higher than broad is drawn smaller.
        let tall = SLENDER[1] * WIDTH as f64 - room[1] as f64;
        let scale = f64::min(across / sides[0].max(1e-300), tall / sides[1].max(1e-300));
        let scale = if scale.is_finite() && sides != [0.0; 2] {
            scale
        } else {
            1.0
        };
        let height = (scale * sides[1]).max(SLENDER[0] * WIDTH as f64 - room[1] as f64);
        let keys = key::height(self.key, WIDTH - 2 * BORDER);
        let bottom = height as usize + room[1];
        let mut canvas = Canvas::new(WIDTH, bottom + LINE + keys);
        let spare = [across - scale * sides[0], height - scale * sides[1]];
        let place = |p: [f64; 2]| {
            [
                0.5 * (room[0] as f64 + spare[0]) + scale * (p[0] - low[0]),
                height + (BORDER + mark[1] / 2) as f64 - 0.5 * spare[1] - scale * (p[1] - low[1]),
            ]
        };
        let places: Vec<[f64; 2]> = self.points.iter().map(|p| place(*p)).collect();
        for (at, picture) in places.iter().zip(self.marks) {
            let corner = [0, 1].map(|k| (at[k] - 0.5 * mark[k] as f64).max(0.0) as usize);
            canvas.overlay(picture, corner);
        }
        let named = self.names.len() <= MOST_NAMES;
        for (i, at) in places.iter().enumerate() {
            let under = at[1] - 0.5 * mark[1] as f64 + self.marks[i].last_row() as f64;
            let middle = [at[0] as f32, under as f32 + 5.0];
            let name = if named { &self.names[i] } else { "" };
            key::centred(&mut canvas, self.groups[i], name, middle, 124.0);
        }
        self.scale_bar(&mut canvas, bottom, scale);
        key::draw(
            &mut canvas,
            self.key,
            [BORDER, bottom + LINE - 4],
            WIDTH - 2 * BORDER,
        );
        canvas
    }

    fn scale_bar(&self, canvas: &mut Canvas, top: usize, scale: f64) {
        let length = round_below(SCALE * WIDTH as f64 / scale);
        let (x, y) = (BORDER as f32, top as f32 + 10.0);
        let end = x + (length * scale) as f32;
        for line in [
            [[x, y], [end, y]],
            [[x, y - 4.0], [x, y + 4.0]],
            [[end, y - 4.0], [end, y + 4.0]],
        ] {
            canvas.line(&line, false, 1.4, GREY);
        }
        let words = format!("{} = {}", self.unit, scale::number(length));
        let at = [end + 10.0, y - 0.5 * SIZE];
        text::draw(canvas, &words, at, SIZE, GREY);
        let right = (WIDTH - BORDER) as f32 - text::width(self.title, SIZE);
        text::draw(canvas, self.title, [right, y - 0.5 * SIZE], SIZE, GREY);
    }
}

/// The least coordinates, and the sides of the box around points.
fn extent(points: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    let along = |k: usize| points.iter().map(move |p| p[k]);
    let low = [0, 1].map(|k| along(k).fold(f64::INFINITY, f64::min));
    let high = [0, 1].map(|k| along(k).fold(f64::NEG_INFINITY, f64::max));
    if points.is_empty() {
        return ([0.0; 2], [0.0; 2]);
    }
    (low, [high[0] - low[0], high[1] - low[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::colour;

    fn mark(index: usize) -> Canvas {
        let mut canvas = Canvas::new(60, 60);
        let ring: Vec<[f32; 2]> = (0..40)
            .map(|k| {
                let (sin, cos) = (k as f32 * std::f32::consts::TAU / 40.0).sin_cos();
                [30.0 + 20.0 * cos, 30.0 + 14.0 * sin]
            })
            .collect();
        canvas.fill(&[ring], colour(index));
        canvas
    }

    #[test]
    fn every_object_is_at_its_point() {
        let key = [0, 1, 2, 3].map(|i| Key {
            name: format!("class-{i}"),
            category: i,
        });
        for (name, points) in [
            (
                "square",
                [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]],
            ),
            ("line", [[-1.0, 0.0], [0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]),
            ("tall", [[0.0, -3.0], [0.1, 0.0], [0.2, 1.0], [0.0, 2.0]]),
            ("point", [[0.0; 2]; 4]),
        ] {
            let marks: Vec<Canvas> = (0..4).map(mark).collect();
            let names: Vec<String> = (0..4).map(|i| format!("shape-{i}")).collect();
            let plot = ScatterPlot {
                points: &points,
                marks: &marks,
                names: &names,
                groups: &[0, 1, 2, 3],
                key: &key,
                title: "stress .031, .92 of the variance",
                unit: "L",
            };
            let canvas = plot.draw();
            if let Ok(folder) = std::env::var("SHAPESPACE_PICTURES") {
                let file = format!("scatter_{name}.png");
                canvas
                    .write_png(&std::path::Path::new(&folder).join(file))
                    .unwrap();
            }
            let [width, height] = canvas.size();
            // Middles of the marks, as the means of their pixels.
            let middle = |i: usize| {
                let near = |at: usize| {
                    let pixel = canvas.pixel(at % width, at / width);
                    // Rounding of the mixing of colours.
                    (0..3).all(|k| (pixel[k] - colour(i)[k]).abs() < 1e-5)
                };
                let rows = height - LINE - key::height(&key, width);
                let found: Vec<usize> = (0..width * rows).filter(|&at| near(at)).collect();
                let mean = |k: usize| {
                    let values = found
                        .iter()
                        .map(|at| if k == 0 { at % width } else { at / width });
                    values.sum::<usize>() as f64 / found.len() as f64
                };
                (found.len(), [mean(0), mean(1)])
            };
            if name == "point" {
                assert!(middle(3).0 > 500);
                continue;
            }
            let at: Vec<[f64; 2]> = (0..4).map(|i| middle(i).1).collect();
            let scale = |a: usize, b: usize| {
                let distance = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
                distance(at[a], at[b]) / distance(points[a], points[b])
            };
            // Marks are placed to a pixel, and stand upright.
            assert!(
                (scale(0, 3) / scale(0, 1) - 1.0).abs() < 0.02,
                "{name}: {at:?}"
            );
            if name != "line" {
                assert!(at[0][1] > at[3][1]);
            }
        }
    }

    #[test]
    fn marks_are_small_where_points_are_dense() {
        let row = |n: usize| -> Vec<[f64; 2]> { (0..n).map(|i| [i as f64, 0.0]).collect() };
        assert_eq!(ScatterPlot::mark_side(&row(2)), 110);
        assert_eq!(ScatterPlot::mark_side(&row(16)), 73);
        for small in [row(500), vec![[0.3; 2]; 4], Vec::new()] {
            assert_eq!(ScatterPlot::mark_side(&small), 48);
        }
        assert_eq!(ScatterPlot::mark_side(&row(1)), 110);
    }
}
