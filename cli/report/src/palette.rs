//! Colours with the markers and dashes that go with them.
//!
//! The eight categorical colours and the ink are distinguishable under normal vision and under each
//! of the three colour-vision deficiencies: the CIEDE2000 difference of any two is at least 10 (2
//! is just noticeable side by side). Markers repeat after seven, so that marker and colour together
//! distinguish 56 categories; dashes change after every eight lines.

/// Red, green and blue in `[0, 1]`, as stored in files (sRGB).
pub type Colour = [f32; 3];

/// Background.
pub const WHITE: Colour = [1.0; 3];
/// Titles, and items of all categories.
pub const INK: Colour = [0.13, 0.15, 0.18];
/// Labels.
pub const GREY: Colour = [0.42, 0.45, 0.49];
/// Frames and mesh lines.
pub const PALE: Colour = [0.86, 0.87, 0.89];

/// A colour between two others.
#[inline]
pub fn mix(a: Colour, b: Colour, t: f32) -> Colour {
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

/// Blue, vermilion, green, purple, ochre, sky, rose, brown.
const CATEGORIES: [[u8; 3]; 8] = [
    [2, 92, 213],
    [178, 71, 0],
    [1, 135, 87],
    [91, 37, 118],
    [180, 144, 26],
    [18, 160, 205],
    [214, 91, 147],
    [96, 46, 12],
];

/// The colour of a category. They repeat after eight.
pub fn colour(index: usize) -> Colour {
    CATEGORIES[index % CATEGORIES.len()].map(|c| f32::from(c) / 255.0)
}

/// A categorical colour as that of a shaded surface, whose shadows darken it.
pub fn solid(colour: Colour) -> Colour {
    colour.map(|c| (1.1 * c + 0.12).min(1.0))
}

/// A categorical colour as that of an area whose boundary has the full colour.
pub fn tint(colour: Colour) -> Colour {
    mix(WHITE, colour, 0.3)
}

/// From pale through yellow and red to dark.
const HEAT: [Colour; 6] = [
    [0.97, 0.95, 0.86],
    [0.98, 0.84, 0.52],
    [0.95, 0.60, 0.28],
    [0.84, 0.33, 0.26],
    [0.58, 0.13, 0.34],
    [0.25, 0.05, 0.32],
];
/// Dark blue to orange.
const TIME: [Colour; 2] = [[0.05, 0.18, 0.48], [0.93, 0.57, 0.16]];
/// From blue to vermilion, darkest in the middle.
const SIDES: [Colour; 3] = [[0.16, 0.55, 0.93], INK, [0.88, 0.45, 0.10]];

/// The colour of a size between 0 and 1: the larger, the darker.
pub fn heat(share: f64) -> Colour {
    between(&HEAT, share)
}

/// The colour of a time between 0 and 1: the later, the lighter.
pub fn time(time: f64) -> Colour {
    between(&TIME, time)
}

/// The colour of a deviation between -1 and 1: the larger, the lighter.
pub fn deviation(share: f64) -> Colour {
    between(&SIDES, 0.5 * (share + 1.0))
}

/// Interpolates between equidistant colours; the parameter is clamped to `[0, 1]`.
fn between(stops: &[Colour], share: f64) -> Colour {
    let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    // NaN counts as zero.
    let stop = (place as usize).min(stops.len() - 2);
    mix(stops[stop], stops[stop + 1], (place - stop as f64) as f32)
}

/// The marker of a category.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// A disc.
    Circle,
    /// A square.
    Square,
    /// A triangle pointing up.
    Triangle,
    /// A diamond.
    Diamond,
    /// A diagonal cross.
    Cross,
    /// A triangle pointing down.
    Wedge,
    /// An upright cross.
    Plus,
}

impl Marker {
    const ALL: [Self; 7] = [
        Self::Circle,
        Self::Square,
        Self::Triangle,
        Self::Diamond,
        Self::Cross,
        Self::Wedge,
        Self::Plus,
    ];

    /// Returns the marker of a category; markers repeat after seven.
    pub fn of(index: usize) -> Self {
        Self::ALL[index % Self::ALL.len()]
    }

    /// Returns the boundary of the marker around the origin, with about the area of a disc of this
    /// radius; `y` points down.
    pub fn outline(self, radius: f32) -> Vec<[f32; 2]> {
        /// Half the width of the bars of a cross.
        const BAR: f32 = 0.33;
        let turned = |n: usize, first: f32, size: f32| {
            let angle = move |k: usize| first + std::f32::consts::TAU * k as f32 / n as f32;
            (0..n).map(move |k| [size * angle(k).cos(), size * angle(k).sin()])
        };
        let up = -std::f32::consts::FRAC_PI_2;
        let plus = [[-BAR, -1.15], [BAR, -1.15], [BAR, -BAR]];
        let plus = (0..4).flat_map(|quarter| {
            plus.map(|[x, y]| match quarter {
                0 => [x, y],
                1 => [-y, x],
                2 => [-x, -y],
                _ => [y, -x],
            })
        });
        let points: Vec<[f32; 2]> = match self {
            Self::Circle => turned(24, up, 1.0).collect(),
            Self::Square => turned(4, up / 2.0, 1.25).collect(),
            Self::Triangle => turned(3, up, 1.4).collect(),
            Self::Diamond => turned(4, up, 1.25).collect(),
            Self::Wedge => turned(3, -up, 1.4).collect(),
            Self::Plus => plus.collect(),
            Self::Cross => {
                let eighth = std::f32::consts::FRAC_1_SQRT_2;
                plus.map(|[x, y]| [eighth * (x - y), eighth * (x + y)])
                    .collect()
            }
        };
        points.iter().map(|p| p.map(|c| radius * c)).collect()
    }
}

/// Lengths of the dashes of a line and of the gaps between them; empty for a solid line, as for the
/// first eight.
pub fn dashes(index: usize) -> Option<[f32; 2]> {
    match (index / CATEGORIES.len()) % 3 {
        0 => None,
        1 => Some([7.0, 4.0]),
        _ => Some([2.0, 3.0]),
    }
}

#[cfg(test)]
mod vision;

#[cfg(test)]
mod tests {
    use super::vision::{SIGHTS, Sight, difference, lab};
    use super::*;

    const LEAST: f64 = 10.0;

    fn lightness(colour: Colour) -> f64 {
        lab(colour, Sight::Normal)[0]
    }

    #[test]
    fn categories_are_told_apart_under_every_sight() {
        let lines: Vec<Colour> = (0..CATEGORIES.len()).map(colour).chain([INK]).collect();
        let surfaces: Vec<Colour> = (0..CATEGORIES.len()).map(|i| solid(colour(i))).collect();
        for palette in [lines, surfaces] {
            for sight in SIGHTS {
                for (i, a) in palette.iter().enumerate() {
                    for (j, b) in palette[..i].iter().enumerate() {
                        let found = difference(lab(*a, sight), lab(*b, sight));
                        assert!(found >= LEAST, "{sight:?} {i} {j}: {found}");
                    }
                }
            }
        }
        for i in 0..CATEGORIES.len() {
            // At least 3 to 1 in contrast on white.
            assert!(lightness(colour(i)) < 61.7, "{i}");
        }
    }

    #[test]
    fn markers_and_colours_tell_56_categories_apart() {
        let style = |i: usize| (Marker::of(i), CATEGORIES[i % CATEGORIES.len()]);
        for i in 0..56 {
            assert!((0..i).all(|j| style(i) != style(j)), "{i}");
        }
        assert_eq!(style(56), style(0));
        let lines: Vec<_> = (0..24).map(|i| (colour(i), dashes(i))).collect();
        for (i, line) in lines.iter().enumerate() {
            assert!(!lines[..i].contains(line), "{i}");
        }
    }

    #[test]
    fn markers_have_about_the_area_of_a_disc() {
        for marker in Marker::ALL {
            let points = marker.outline(5.0);
            let twice: f32 = (0..points.len())
                .map(|i| (points[i], points[(i + 1) % points.len()]))
                .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
                .sum();
            let share = 0.5 * twice / (25.0 * std::f32::consts::PI);
            assert!((0.7..1.1).contains(&share), "{marker:?} {share}");
        }
    }

    /// Under every kind of vision, if the map is monotone.
    fn rises(map: impl Fn(f64) -> Colour) {
        for sight in SIGHTS {
            let lightness: Vec<f64> = (0..=50)
                .map(|k| lab(map(f64::from(k) / 50.0), sight)[0])
                .collect();
            for (k, pair) in lightness.windows(2).enumerate() {
                assert!(pair[0] < pair[1], "{sight:?} {k} {pair:?}");
            }
            assert!(lightness[50] - lightness[0] > 30.0, "{sight:?}");
        }
    }

    #[test]
    fn maps_are_monotone_in_lightness() {
        rises(|share| heat(1.0 - share));
        rises(time);
        rises(deviation);
        rises(|share| deviation(-share));
        for sight in SIGHTS {
            let [less, more] = [-1.0, 1.0].map(|share| lab(deviation(share), sight));
            assert!(difference(less, more) > 20.0, "{sight:?}");
        }
        assert_eq!(heat(-1.0), heat(0.0));
        assert_eq!(heat(7.0), heat(1.0));
        assert!(heat(f64::NAN).iter().all(|c| c.is_finite()) || heat(f64::NAN)[0].is_nan());
    }
}
