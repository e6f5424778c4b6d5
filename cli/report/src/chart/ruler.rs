//! Axes: their ranges and the positions of their labels.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};

use super::{Axis, Scale};

/// Approximate number of labels on an axis.
const LABELS: f64 = 7.0;
/// Numbers beyond this, and positive ones below its inverse on logarithmic axes, are left out: the
/// ratio of any two others is a number.
const LARGEST: f64 = 1e150;
/// Positions off an axis are at most so many lengths of it away.
const FAR: f64 = 4.0;

/// Whether an axis has a place for a number.
pub(super) fn has_place(value: f64, logarithmic: bool) -> bool {
    value.abs() <= LARGEST && (!logarithmic || value >= LARGEST.recip())
}

impl Axis<'_> {
    /// The axis for these numbers.
    pub(super) fn ruler(&self, values: impl Iterator<Item = f64>) -> Ruler {
        let logarithmic = self.scale == Scale::Logarithmic;
        let shown = |v: &f64| has_place(*v, logarithmic);
        let (low, high) = values
            .filter(shown)
            .fold((f64::INFINITY, 0.0), |(low, high), v| {
                (f64::min(low, v), f64::max(high, v))
            });
        let range = match self.scale {
            Scale::Counts => 0.0..1.02 * high.max(1.0),
            Scale::Linear if high >= LARGEST.recip() => 0.0..1.15 * high,
            Scale::Logarithmic if low <= high => {
                let room = (high / low).powf(0.06).max(1.25);
                low / room..high * room
            }
            Scale::Linear => 0.0..1.0,
            Scale::Logarithmic => 0.1..1.0,
        };
        let marks = if logarithmic {
            round_powers(&range)
        } else {
            let step = round_above(range.end / LABELS);
            let counts = self.scale == Scale::Counts;
            let step = if counts { step.max(1.0) } else { step };
            let last = (range.end / step) as usize;
            (0..=last).map(|k| k as f64 * step).collect()
        };
        Ruler {
            logarithmic,
            range,
            marks,
        }
    }
}

/// Powers of ten in a range; if they are few, also round numbers between them.
fn round_powers(range: &Range<f64>) -> Vec<f64> {
    let [first, last] = [range.start, range.end].map(f64::log10);
    let digits: &[f64] = match last - first {
        ..0.5 => &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
        ..1.0 => &[1.0, 2.0, 3.0, 5.0, 7.0],
        ..3.0 => &[1.0, 2.0, 5.0],
        _ => &[1.0],
    };
    let stride = round_above((last - first) / LABELS).max(1.0) as i32;
    (first.floor() as i32..=last.ceil() as i32)
        .filter(|power| power.rem_euclid(stride) == 0)
        .flat_map(|power| digits.iter().map(move |digit| digit * 10f64.powi(power)))
        .filter(|mark| range.contains(mark))
        .collect()
}

/// An axis for the plotting library: its range and the positions of its labels.
pub(super) struct Ruler {
    pub logarithmic: bool,
    pub range: Range<f64>,
    marks: Vec<f64>,
}

impl Ranged for Ruler {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        let place = |x: f64| if self.logarithmic { x.log10() } else { x };
        let [from, to] = [self.range.start, self.range.end].map(place);
        let share = ((place(*value) - from) / (to - from)).clamp(-FAR, FAR);
        first + (share * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() {
            Vec::new()
        } else {
            self.marks.clone()
        }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

/// Returns the smallest of 1, 2 and 5 times a power of ten that is at least a positive number.
pub fn round_above(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let digit = value / power;
    let round = [1.0, 2.0, 5.0].into_iter().find(|r| digit <= *r);
    round.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(scale: Scale) -> Axis<'static> {
        Axis {
            scale,
            ..Axis::linear("x")
        }
    }

    #[test]
    fn labels_are_round_numbers_in_the_range() {
        let found = axis(Scale::Counts).ruler([3.0].into_iter()).marks;
        assert_eq!(found, [0.0, 1.0, 2.0, 3.0]);
        for (low, high) in [
            (0.02, 0.1),
            (1e-9, 1e-2),
            (3e-5, 4e-5),
            (1.0, 900.0),
            (7.0, 7.0),
            (6.0, 14.0),
        ] {
            let Ruler { range, marks, .. } =
                axis(Scale::Logarithmic).ruler([low, high, 0.0].into_iter());
            assert!(range.contains(&low) && range.contains(&high));
            assert!((2..=12).contains(&marks.len()), "{low} {high} {marks:?}");
            assert!(marks.windows(2).all(|pair| pair[0] < pair[1]));
            assert!(marks.iter().all(|mark| range.contains(mark)));
            // Numbers of four digits need less than this share of an axis; 9 and 10 are the closest.
            let share = |pair: &[f64]| (pair[1] / pair[0]).ln() / (range.end / range.start).ln();
            assert!(marks.windows(2).all(|pair| share(pair) > 0.09), "{marks:?}");
        }
        for scale in [Scale::Counts, Scale::Linear, Scale::Logarithmic] {
            let extremes = [
                1e300,
                1e-300,
                f64::MAX,
                5e-324,
                f64::INFINITY,
                f64::NAN,
                -1e300,
            ];
            for first in extremes {
                for second in [1.0, -1.0].into_iter().chain(extremes) {
                    let Ruler { range, marks, .. } = axis(scale).ruler([first, second].into_iter());
                    assert!(
                        range.start < range.end && range.end.is_finite(),
                        "{range:?}"
                    );
                    assert!(marks.len() <= 40, "{first} {second} {}", marks.len());
                }
            }
        }
        for length in [1e-300, 1e-7, 0.3, 1.0, 7.0, 83.0] {
            let marks = axis(Scale::Linear).ruler([length].into_iter()).marks;
            assert!((3..=9).contains(&marks.len()), "{length} {marks:?}");
        }
    }
}
