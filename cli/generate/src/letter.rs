//! Letters as own outlines, upright with `y` pointing down as in a picture.

use crate::outline::{Outline, Pen};

/// The longer side of a letter.
const SIDE: f64 = 0.6;

/// A letter that can be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum), value(rename_all = "lower"))]
pub enum Letter {
    /// A with a cross bar.
    A,
    /// B with round bowls.
    B,
    /// B with serifs, a high waist and a wide lower bowl.
    #[cfg_attr(feature = "clap", value(name = "b2"))]
    SerifB,
    /// B, light and narrow, with a low waist.
    #[cfg_attr(feature = "clap", value(name = "b3"))]
    LightB,
    /// C, open to the right.
    C,
    /// M with a deep middle.
    M,
    /// O, a ring.
    O,
    /// U.
    U,
    /// X.
    X,
}

impl Letter {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::A,
        Self::B,
        Self::SerifB,
        Self::LightB,
        Self::C,
        Self::M,
        Self::O,
        Self::U,
        Self::X,
    ];
}

/// The outline of a letter about the origin.
pub fn letter(letter: Letter) -> Outline {
    let curves = match letter {
        Letter::A => vec![
            Pen::polygon(&[
                [0.0, 1.0],
                [0.34, 0.0],
                [0.56, 0.0],
                [0.9, 1.0],
                [0.68, 1.0],
                [0.61, 0.78],
                [0.29, 0.78],
                [0.22, 1.0],
            ]),
            Pen::polygon(&[[0.34, 0.62], [0.56, 0.62], [0.45, 0.26]]),
        ],
        Letter::B => BowedB {
            waist: 0.495,
            upper: 0.66,
            lower: 0.72,
            stem: 0.18,
            bar: 0.15,
            serif: 0.0,
        }
        .draw(),
        Letter::SerifB => BowedB {
            waist: 0.44,
            upper: 0.64,
            lower: 0.80,
            stem: 0.21,
            bar: 0.12,
            serif: 0.09,
        }
        .draw(),
        Letter::LightB => BowedB {
            waist: 0.54,
            upper: 0.56,
            lower: 0.60,
            stem: 0.12,
            bar: 0.11,
            serif: 0.0,
        }
        .draw(),
        Letter::C => vec![
            Pen::default()
                .arc([0.42, 0.5], [0.42, 0.5], 48.0, 312.0)
                .arc([0.42, 0.5], [0.24, 0.33], 308.0, 52.0),
        ],
        Letter::M => vec![Pen::polygon(&[
            [0.0, 1.0],
            [0.0, 0.0],
            [0.24, 0.0],
            [0.5, 0.52],
            [0.76, 0.0],
            [1.0, 0.0],
            [1.0, 1.0],
            [0.8, 1.0],
            [0.8, 0.36],
            [0.58, 0.8],
            [0.42, 0.8],
            [0.2, 0.36],
            [0.2, 1.0],
        ])],
        Letter::O => vec![
            Pen::ellipse([0.44, 0.5], [0.44, 0.5]),
            Pen::ellipse([0.44, 0.5], [0.25, 0.32]),
        ],
        Letter::U => vec![
            Pen::start([0.0, 0.0])
                .line([0.2, 0.0])
                .arc([0.42, 0.58], [0.22, 0.24], 180.0, 0.0)
                .line([0.64, 0.0])
                .line([0.84, 0.0])
                .arc([0.42, 0.58], [0.42, 0.42], 0.0, 180.0),
        ],
        Letter::X => vec![Pen::polygon(&[
            [0.0, 0.0],
            [0.24, 0.0],
            [0.43, 0.34],
            [0.62, 0.0],
            [0.86, 0.0],
            [0.56, 0.5],
            [0.86, 1.0],
            [0.62, 1.0],
            [0.43, 0.66],
            [0.24, 1.0],
            [0.0, 1.0],
            [0.3, 0.5],
        ])],
    };
    Outline::new(curves, SIDE)
}

/// A B of height 1: a stem and two bowls.
struct BowedB {
    /// Height of the centre of the middle bar, from the top.
    waist: f64,
    /// Rightmost point of the upper bowl.
    upper: f64,
    /// Rightmost point of the lower bowl.
    lower: f64,
    /// Width of the stem.
    stem: f64,
    /// Thickness of the horizontal strokes.
    bar: f64,
    /// Length of the serifs to the left, 0 for none.
    serif: f64,
}

impl BowedB {
    fn draw(&self) -> Vec<Pen> {
        // The outer arcs overlap in the middle bar, so that the notch between them is shallow.
        let half = 0.5 * self.bar;
        let upper = self.bowl(0.0, self.waist + half, self.upper);
        let lower = self.bowl(self.waist - half, 1.0, self.lower);
        let (leave, enter) = upper.meets(&lower);
        let outer = Pen::start([-self.serif, 0.0])
            .arc(upper.centre, upper.outer, -90.0, leave)
            .arc(lower.centre, lower.outer, enter, 90.0)
            .line([-self.serif, 1.0]);
        let outer = if self.serif > 0.0 {
            outer
                .line([-self.serif, 1.0 - self.bar])
                .line([0.0, 1.0 - self.bar])
                .line([0.0, self.bar])
                .line([-self.serif, self.bar])
        } else {
            outer
        };
        let hole = |bowl: &Bowl, top: f64, bottom: f64| {
            let middle = 0.5 * (top + bottom);
            let radii = [bowl.outer[0] - self.stem, 0.5 * (bottom - top)];
            Pen::start([self.stem, top])
                .arc([bowl.centre[0], middle], radii, -90.0, 90.0)
                .line([self.stem, bottom])
        };
        vec![
            outer,
            hole(&upper, self.bar, self.waist - half),
            hole(&lower, self.waist + half, 1.0 - self.bar),
        ]
    }

    fn bowl(&self, top: f64, bottom: f64, right: f64) -> Bowl {
        let height = 0.5 * (bottom - top);
        let width = (right - self.stem - 0.1)
            .min(1.15 * height)
            .max(0.6 * height);
        Bowl {
            centre: [right - width, top + height],
            outer: [width, height],
        }
    }
}

struct Bowl {
    centre: [f64; 2],
    outer: [f64; 2],
}

impl Bowl {
    /// Angles on this arc and on a lower one at which they meet, by bisection.
    fn meets(&self, lower: &Self) -> (f64, f64) {
        let seen_from_lower = |angle: f64| -> [f64; 2] {
            let (sin, cos) = angle.to_radians().sin_cos();
            let point = [
                self.centre[0] + self.outer[0] * cos,
                self.centre[1] + self.outer[1] * sin,
            ];
            std::array::from_fn(|k| (point[k] - lower.centre[k]) / lower.outer[k])
        };
        let (mut outside, mut inside) = (0.0, 90.0);
        for _ in 0..50 {
            let middle = 0.5 * (outside + inside);
            let [x, y] = seen_from_lower(middle);
            if x.hypot(y) > 1.0 {
                outside = middle;
            } else {
                inside = middle;
            }
        }
        let [x, y] = seen_from_lower(inside);
        (inside, y.atan2(x).to_degrees())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::implicit::Implicit;

    /// Connected groups of samples inside and outside.
    fn components(outline: &Outline, inside: bool) -> usize {
        const N: usize = 160;
        let at = |i: usize| i as f64 / (N - 1) as f64 * 0.8 - 0.4;
        let mut open: Vec<bool> = (0..N * N)
            .map(|k| (outline.value([at(k % N), at(k / N)]) > 0.0) == inside)
            .collect();
        let mut count = 0;
        for start in 0..N * N {
            if !open[start] {
                continue;
            }
            count += 1;
            let mut stack = vec![start];
            while let Some(k) = stack.pop() {
                if !std::mem::replace(&mut open[k], false) {
                    continue;
                }
                let (x, y) = (k % N, k / N);
                if x > 0 {
                    stack.push(k - 1);
                }
                if x + 1 < N {
                    stack.push(k + 1);
                }
                if y > 0 {
                    stack.push(k - N);
                }
                if y + 1 < N {
                    stack.push(k + N);
                }
            }
        }
        count
    }

    #[test]
    fn every_letter_is_one_piece_with_its_holes() {
        for &which in &Letter::ALL {
            let outline = letter(which);
            let holes = match which {
                Letter::B | Letter::SerifB | Letter::LightB => 2,
                Letter::A | Letter::O => 1,
                _ => 0,
            };
            assert_eq!(components(&outline, true), 1, "{which:?}");
            assert_eq!(components(&outline, false), 1 + holes, "{which:?}");
        }
    }
}
