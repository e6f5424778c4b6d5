//! A tree of clusters, with the objects as its leaves.

use super::text::{SIZE, SMALL};
use super::{Canvas, Colour, GREY, INK, Key, PALE, colour, key, scale, text};

/// Height of all leaves together, about.
const HEIGHT: usize = 1500;
/// Least and greatest height of a leaf.
const LEAVES: [usize; 2] = [12, 50];
/// Width of the tree.
const TREE: usize = 640;
/// Width of the names.
const NAMES: usize = 180;
const BORDER: usize = 18;
/// Height of the axis with its numbers.
const AXIS: usize = 34;
/// Marks on the axis, about.
const TICKS: f64 = 5.0;
/// Sizes of a leaf from which small pictures are visible.
const LEGIBLE: usize = 18;

/// Everything in the picture of a tree.
#[derive(Clone, Copy, Debug)]
pub struct TreeChart<'a> {
    /// Names of the objects.
    pub names: &'a [String],
    /// Small pictures of them, of one size.
    pub marks: &'a [Canvas],
    /// The numbers of their groups, which have the markers and colours of them.
    pub groups: &'a [usize],
    /// The order of the leaves: every cluster stands together in it.
    pub order: &'a [usize],
    /// The two clusters that become one, and at which height. Numbers below that of the objects
    /// are objects, the others merges.
    pub merges: &'a [(usize, usize, f64)],
    /// The cluster of each object that is shown: inside of one, branches have the colour of its
    /// objects where they have one.
    pub labels: &'a [usize],
    /// The legend of the markers.
    pub key: &'a [Key],
    /// The title of the axis of heights.
    pub title: &'a str,
}

/// Where the stem of a cluster is.
#[derive(Clone, Copy)]
struct Stem {
    x: f32,
    y: f32,
    colour: Colour,
    /// The cluster it belongs to, if it is within one.
    label: Option<usize>,
}

impl TreeChart<'_> {
    /// Draws the tree: leaves on the left, the root on the right, and the axis below.
    pub fn draw(&self) -> Canvas {
        let n = self.order.len();
        let leaf = (HEIGHT / n.max(1)).clamp(LEAVES[0], LEAVES[1]);
        let pictured = leaf >= LEGIBLE;
        let left = BORDER + NAMES + if pictured { leaf + 6 } else { 0 };
        let width = left + TREE + BORDER;
        let keys = key::height(self.key, width - 2 * BORDER);
        let bottom = BORDER + n * leaf;
        let mut canvas = Canvas::new(width, bottom + AXIS + BORDER + keys);
        let most = self.merges.iter().map(|m| m.2).fold(0.0, f64::max);
        let most = if most > 0.0 { most } else { 1.0 };
        let scale = TREE as f32 * 0.97 / most as f32;
        self.axis(&mut canvas, [left, bottom], most, scale);
        let mut stems: Vec<Option<Stem>> = vec![None; n];
        for (row, &i) in self.order.iter().enumerate() {
            let y = BORDER + row * leaf;
            let middle = y as f32 + 0.5 * leaf as f32;
            let end = [(BORDER + NAMES - 8) as f32, middle];
            key::before(
                &mut canvas,
                self.groups[i],
                &self.names[i],
                end,
                NAMES as f32 - 12.0,
            );
            if pictured {
                let small = self.marks[i].reduced(leaf - 4);
                let spare = small.size().map(|side| (leaf - side) / 2);
                canvas.overlay(&small, [BORDER + NAMES + spare[0], y + spare[1]]);
            }
            stems[i] = Some(Stem {
                x: left as f32,
                y: middle,
                colour: colour(self.groups[i]),
                label: Some(self.labels[i]),
            });
        }
        for &(a, b, height) in self.merges {
            let of = |k: usize| stems.get(k).copied().flatten();
            if let (Some(a), Some(b)) = (of(a), of(b)) {
                stems.push(Some(joined(
                    &mut canvas,
                    a,
                    b,
                    left as f32 + height as f32 * scale,
                )));
            }
        }
        key::draw(
            &mut canvas,
            self.key,
            [BORDER, bottom + AXIS + BORDER - 6],
            width - 2 * BORDER,
        );
        canvas
    }

    fn axis(&self, canvas: &mut Canvas, [left, bottom]: [usize; 2], most: f64, scale: f32) {
        let step = round_below(most / TICKS * 1.5);
        for tick in 0..=(most / step) as usize {
            let value = tick as f64 * step;
            let x = left as f32 + value as f32 * scale;
            let line = [[x, BORDER as f32 - 6.0], [x, bottom as f32 + 4.0]];
            canvas.line(&line, false, 1.0, PALE);
            let number = if tick == 0 {
                "0".into()
            } else {
                scale::number(value)
            };
            let at = [x, bottom as f32 + 8.0];
            text::centred(canvas, &number, at, SMALL, 80.0, GREY);
        }
        let middle = [left as f32 + 0.5 * TREE as f32, bottom as f32 + 22.0];
        text::centred(canvas, self.title, middle, SIZE, TREE as f32, GREY);
    }
}

/// Draws the branches of a merge, and returns its stem.
fn joined(canvas: &mut Canvas, a: Stem, b: Stem, x: f32) -> Stem {
    const WIDTH: f32 = 1.6;
    let within = a.label.is_some() && a.label == b.label;
    let colour = if within && a.colour == b.colour {
        a.colour
    } else {
        INK
    };
    for stem in [a, b] {
        let line = [[stem.x, stem.y], [x, stem.y]];
        canvas.line(&line, false, WIDTH, stem.colour);
    }
    canvas.line(&[[x, a.y], [x, b.y]], false, WIDTH, colour);
    Stem {
        x,
        y: 0.5 * (a.y + b.y),
        colour,
        label: if within { a.label } else { None },
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is not above a positive number.
pub(crate) fn round_below(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let digit = value / power;
    let round = [5.0, 2.0].into_iter().find(|r| digit >= *r).unwrap_or(1.0);
    round * power
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::WHITE;

    #[test]
    fn numbers_are_rounded() {
        let found = [0.037, 1.0, 4.99, 63.0].map(round_below);
        for (found, expected) in found.into_iter().zip([0.02, 1.0, 2.0, 50.0]) {
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn branches_are_drawn_at_their_heights() {
        let names: Vec<String> = (0..5)
            .map(|i| format!("a-long-name-of-shape-{i}"))
            .collect();
        let mut mark = Canvas::new(44, 44);
        mark.line(&[[4.0, 4.0], [40.0, 40.0]], false, 3.0, [0.2; 3]);
        let labels = [0, 0, 1, 1, 1];
        let key = [0, 1].map(|i| Key {
            name: format!("class {i}"),
            category: i,
        });
        let canvas = TreeChart {
            names: &names,
            marks: &vec![mark; 5],
            groups: &labels,
            order: &[1, 0, 4, 2, 3],
            merges: &[(2, 3, 0.1), (0, 1, 0.15), (4, 5, 0.2), (6, 7, 0.4)],
            labels: &labels,
            key: &key,
            title: "distance L",
        }
        .draw();
        if let Ok(folder) = std::env::var("SHAPESPACE_PICTURES") {
            canvas
                .write_png(&std::path::Path::new(&folder).join("tree.png"))
                .unwrap();
        }
        let leaf = LEAVES[1];
        let left = (BORDER + NAMES + leaf + 6) as f32;
        let at = |height: f32, row: f32| {
            let x = left + height / 0.4 * TREE as f32 * 0.97;
            canvas.pixel(
                x as usize,
                (BORDER as f32 + (row + 0.5) * leaf as f32) as usize,
            )
        };
        let near = |a: Colour, b: Colour| (0..3).all(|k| (a[k] - b[k]).abs() < 0.2);
        assert!(near(at(0.15, 0.5), colour(0)));
        assert!(near(at(0.1, 3.5), colour(1)));
        assert!(near(at(0.2, 2.4), colour(1)));
        assert!(near(at(0.4, 1.5), INK));
        assert_eq!(at(0.25, 2.0), WHITE);
    }
}
