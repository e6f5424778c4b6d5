//! A map of objects, each drawn at its point.

use super::text::SIZE;
use super::tree::round_below;
use super::{Canvas, GREY, Key, WHITE, colour, key, mix, scale, text};

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
/// Longest label with its marker.
const MOST: f32 = 124.0;
/// Distance of a label from its object, and more of it from one ring of candidates to the next.
const GAPS: [f32; 2] = [5.0, 12.0];
/// Rings of candidates.
const RINGS: usize = 40;
/// A label on another object is as bad as one that is this many rings further out.
const ON_OBJECT: usize = 3;
/// Distance of labels from each other and from the edges of the picture.
const CLEARANCE: f32 = 3.0;

/// An axis through a map, with a shape at each end.
#[derive(Clone, Debug)]
pub struct Axis {
    /// The ends.
    pub points: [[f64; 2]; 2],
    /// The pictures there, of the size of all marks.
    pub marks: [Canvas; 2],
    /// The labels there.
    pub names: [String; 2],
}

/// A closed curve, such as an ellipse, and the number of its group.
pub type GroupCurve = (Vec<[f64; 2]>, usize);

/// Everything in a map.
#[derive(Clone, Copy, Debug)]
pub struct ScatterPlot<'a> {
    /// The points.
    pub points: &'a [[f64; 2]],
    /// The pictures at the points, all of one size.
    pub marks: &'a [Canvas],
    /// The labels below the marks.
    pub names: &'a [String],
    /// The numbers of their groups, which have the markers of them.
    pub groups: &'a [usize],
    /// The legend of the markers.
    pub key: &'a [Key],
    /// Curves behind the marks.
    pub curves: &'a [GroupCurve],
    /// Axes behind the marks.
    pub axes: &'a [Axis],
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
        // Coinciding points have no extent; a single one is far from all others.
        let pixels = WIDTH as f64 * if share.is_nan() { 0.0 } else { share };
        pixels.clamp(MARKS[0], MARKS[1]) as usize
    }

    /// Draws the map at one scale along both axes, the second axis upwards.
    pub fn draw(&self) -> Canvas {
        let mark = self.marks.first().map_or([1; 2], Canvas::size);
        let room = [mark[0] + 2 * BORDER, mark[1] + 2 * BORDER + SIZE as usize];
        let on_curves = self.curves.iter().flat_map(|(curve, _)| curve);
        let ends = self.axes.iter().flat_map(|axis| &axis.points);
        let all: Vec<[f64; 2]> = self
            .points
            .iter()
            .chain(ends)
            .chain(on_curves)
            .copied()
            .collect();
        let (low, sides) = extent(&all);
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
        self.lines(&mut canvas, &place);
        // The ends of the axes follow the objects.
        let ends = || self.axes.iter().flat_map(|axis| &axis.points);
        let places: Vec<[f64; 2]> = self
            .points
            .iter()
            .chain(ends())
            .map(|p| place(*p))
            .collect();
        let marks: Vec<&Canvas> = self
            .marks
            .iter()
            .chain(self.axes.iter().flat_map(|axis| &axis.marks))
            .collect();
        let (objects, ends) = (0..self.points.len(), self.points.len()..places.len());
        for i in ends.chain(objects) {
            let (at, picture) = (places[i], marks[i]);
            let corner = [0, 1].map(|k| (at[k] - 0.5 * mark[k] as f64).max(0.0) as usize);
            canvas.overlay(picture, corner);
        }
        let named = self.names.len() <= MOST_NAMES;
        let objects_alone = self.points.len();
        let end_names: Vec<&String> = self.axes.iter().flat_map(|axis| &axis.names).collect();
        let name = |i: usize| match i.checked_sub(objects_alone) {
            Some(end) => end_names[end].as_str(),
            None if named => self.names[i].as_str(),
            None => "",
        };
        let objects: Vec<Area> = places
            .iter()
            .zip(&marks)
            .map(|(at, mark)| inked(mark, *at))
            .collect();
        let widths: Vec<f32> = (0..places.len()).map(|i| label_width(name(i))).collect();
        let rings = if named { RINGS } else { 1 };
        let labels = place_labels(&objects, &widths, [WIDTH, bottom].map(|n| n as f32), rings);
        for (label, object) in labels.iter().zip(&objects) {
            if let Some(leader) = leader(label, object) {
                canvas.line(&leader, false, 1.0, GREY);
            }
        }
        for (i, [low, high]) in labels.iter().enumerate() {
            let middle = [0.5 * (low[0] + high[0]), low[1]];
            match self.groups.get(i).filter(|_| i < objects_alone) {
                Some(&group) => key::centred(&mut canvas, group, name(i), middle, MOST),
                None => text::centred(&mut canvas, name(i), middle, text::SMALL, MOST, GREY),
            }
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

    /// The axes, and the curves in the colours of their groups.
    fn lines(&self, canvas: &mut Canvas, place: &dyn Fn([f64; 2]) -> [f64; 2]) {
        let pixels = |points: &[[f64; 2]]| -> Vec<[f32; 2]> {
            let places = points.iter().map(|p| place(*p).map(|x| x as f32));
            places.collect()
        };
        for axis in self.axes {
            canvas.line(&pixels(&axis.points), false, 1.0, mix(WHITE, GREY, 0.5));
        }
        for (curve, group) in self.curves {
            canvas.line(&pixels(curve), true, 1.6, mix(WHITE, colour(*group), 0.6));
        }
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

/// A box: its least and its greatest coordinates in pixels.
type Area = [[f32; 2]; 2];

/// The box around what is drawn of an object whose picture has its middle at a point.
fn inked(mark: &Canvas, at: [f64; 2]) -> Area {
    let size = mark.size();
    let all = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
    let drawn = all.filter(|[x, y]| mark.pixel(*x, *y) != WHITE);
    let empty = ([usize::MAX; 2], [0; 2]);
    let (low, high) = drawn.fold(empty, |(low, high), p| {
        (
            [0, 1].map(|k| low[k].min(p[k])),
            [0, 1].map(|k| high[k].max(p[k])),
        )
    });
    let place = |k: usize, pixel: usize| (at[k] - 0.5 * size[k] as f64) as f32 + pixel as f32;
    if low[0] > high[0] {
        return [at.map(|c| c as f32); 2];
    }
    [
        [0, 1].map(|k| place(k, low[k])),
        [0, 1].map(|k| place(k, high[k])),
    ]
}

/// The width of a label with its marker.
fn label_width(name: &str) -> f32 {
    let used = SIZE + key::SPACES[0];
    used + text::width(
        &text::shortened(name, text::SMALL, MOST - used),
        text::SMALL,
    )
}

/// Whether two boxes are closer than a distance.
fn close(a: &Area, b: &Area, distance: f32) -> bool {
    (0..2).all(|k| a[0][k] < b[1][k] + distance && b[0][k] < a[1][k] + distance)
}

/// Places labels next to their objects, one after the other: each where it overlaps no earlier label
/// and does not leave the picture, close to its object, and if possible on no other object.
fn place_labels(objects: &[Area], widths: &[f32], picture: [f32; 2], rings: usize) -> Vec<Area> {
    let mut labels: Vec<Area> = Vec::with_capacity(objects.len());
    for (object, &width) in objects.iter().zip(widths) {
        let cost = |(ring, label): &(usize, Area)| {
            let on_object = objects.iter().any(|other| close(label, other, 0.0));
            ring + if on_object { ON_OBJECT } else { 0 }
        };
        let free = (0..rings)
            .flat_map(|ring| candidates(object, width, ring, picture).map(|label| (ring, label)))
            .filter(|(_, label)| {
                let inside = label[0][1] >= CLEARANCE && label[1][1] <= picture[1] - CLEARANCE;
                inside && !labels.iter().any(|other| close(label, other, CLEARANCE))
            });
        let found = free.min_by_key(cost).map(|(_, label)| label);
        labels.push(found.unwrap_or(candidates(object, width, 0, picture)[0]));
    }
    labels
}

/// The places of a label around its object in a ring, the best first; they are shifted sideways into
/// the picture.
fn candidates([low, high]: &Area, width: f32, ring: usize, picture: [f32; 2]) -> [Area; 8] {
    let gap = GAPS[0] + ring as f32 * GAPS[1];
    let (left, right) = (low[0] - gap - width, high[0] + gap);
    let (above, below) = (low[1] - gap - SIZE, high[1] + gap);
    let x = 0.5 * (low[0] + high[0] - width);
    let y = 0.5 * (low[1] + high[1] - SIZE);
    [
        [x, below],
        [x, above],
        [right, y],
        [left, y],
        [right, below],
        [left, below],
        [right, above],
        [left, above],
    ]
    .map(|[x, y]| {
        let x = x.min(picture[0] - CLEARANCE - width).max(CLEARANCE);
        [[x, y], [x + width, y + SIZE]]
    })
}

/// The line from a label to its object, if the label is not next to it.
fn leader(label: &Area, object: &Area) -> Option<[[f32; 2]; 2]> {
    let nearest =
        |a: &Area, b: &Area| [0, 1].map(|k| (0.5 * (b[0][k] + b[1][k])).clamp(a[0][k], a[1][k]));
    let ends = [nearest(label, object), nearest(object, label)];
    let length = (ends[0][0] - ends[1][0]).hypot(ends[0][1] - ends[1][1]);
    (length > GAPS[0] + 0.5 * GAPS[1]).then_some(ends)
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
    use crate::colour;

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
                curves: &[],
                axes: &[],
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
    fn labels_neither_overlap_nor_leave_the_picture() {
        let picture = [600.0, 400.0];
        // Objects that coincide, objects at the edges, and one by itself.
        let mut middles = vec![[300.0, 200.0]; 12];
        middles.extend([[4.0, 100.0], [596.0, 100.0], [100.0, 4.0], [100.0, 396.0]]);
        middles.push([500.0, 300.0]);
        let objects: Vec<Area> = middles
            .iter()
            .map(|[x, y]| [[x - 20.0, y - 12.0], [x + 20.0, y + 12.0]])
            .collect();
        let widths: Vec<f32> = (0..objects.len()).map(|i| 50.0 + 4.0 * i as f32).collect();
        let labels = place_labels(&objects, &widths, picture, RINGS);
        for (i, label) in labels.iter().enumerate() {
            let inside = |k: usize| label[0][k] >= 0.0 && label[1][k] <= picture[k];
            assert!(inside(0) && inside(1), "{i} {label:?}");
            assert!((label[1][0] - label[0][0] - widths[i]).abs() < 1e-3);
            let earlier = labels[..i].iter();
            assert_eq!(earlier.filter(|other| close(label, other, 0.0)).count(), 0);
        }
        // The label of the last object is just below it; those of coinciding objects are led to.
        let last = objects.len() - 1;
        assert_eq!(
            labels[last][0],
            [500.0 - 0.5 * widths[last], 312.0 + GAPS[0]]
        );
        assert!(leader(&labels[last], &objects[last]).is_none());
        let led = |i: &usize| leader(&labels[*i], &objects[*i]).is_some();
        assert!((0..12).filter(led).count() >= 4);
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
