//! Closed contours that are filled, one after the other, as a drawing is painted.

use std::borrow::Cow;

use levelset::Contour;

use super::winding::{Fill, Samples, for_each_number, winding_numbers};

/// Closed contours, each filled by its own rule: what lies inside of any of them is the object.
#[derive(Clone, Debug)]
pub struct Filled<const D: usize> {
    /// The contours, one or more.
    parts: Vec<(Contour<D>, Fill)>,
}

/// What lies inside, at samples.
pub(crate) struct Covered {
    /// The winding numbers of all contours together.
    pub numbers: Vec<i32>,
    pub inside: Vec<bool>,
}

impl<const D: usize> Filled<D> {
    /// A contour alone.
    pub(crate) fn of_one(contour: Contour<D>, fill: Fill) -> Self {
        Self {
            parts: vec![(contour, fill)],
        }
    }

    /// Several contours, of which there is at least one.
    pub(crate) fn of_parts(parts: Vec<(Contour<D>, Fill)>) -> Option<Self> {
        (!parts.is_empty()).then_some(Self { parts })
    }

    /// The contours with their rules.
    pub fn parts(&self) -> &[(Contour<D>, Fill)] {
        &self.parts
    }

    /// All contours as one.
    pub fn whole(&self) -> Cow<'_, Contour<D>> {
        if let [(only, _)] = &self.parts[..] {
            return Cow::Borrowed(only);
        }
        let contours = self.parts.iter().map(|(contour, _)| contour);
        let whole = contours.fold(None, |whole: Option<Contour<D>>, next| {
            Some(match whole {
                Some(whole) => whole.joined(next),
                None => next.clone(),
            })
        });
        // There is at least one.
        Cow::Owned(whole.expect("the contours of an object"))
    }

    /// What lies inside at the samples of a lattice, or why that is not known. `whole` is [`Self::whole`].
    pub(crate) fn covered(
        &self,
        whole: &Contour<D>,
        samples: &Samples<D>,
    ) -> Result<Covered, &'static str> {
        let numbers = winding_numbers(whole, samples)?;
        let inside = if let [(_, fill)] = &self.parts[..] {
            numbers.iter().map(|&n| fill.holds(n)).collect()
        } else {
            let mut inside = vec![false; numbers.len()];
            for (contour, fill) in &self.parts {
                for_each_number(contour, samples, |index, n| inside[index] |= fill.holds(n))?;
            }
            inside
        };
        Ok(Covered { numbers, inside })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square, its corners in a circle to the left, or to the right.
    fn square(corner: f64, side: f64, is_left: bool) -> Contour<2> {
        let [a, b] = [corner, corner + side];
        let square = Contour::new(
            vec![[a, a], [b, a], [b, b], [a, b]],
            vec![[0, 1], [1, 2], [2, 3], [3, 0]],
        );
        let square = square.unwrap();
        if is_left { square } else { square.flipped() }
    }

    #[test]
    fn parts_are_united_whatever_their_direction() {
        let samples = Samples {
            size: [20, 20],
            spacing: 0.5,
            origin: [0.25; 2],
        };
        let count = |parts: Vec<(Contour<2>, Fill)>| {
            let filled = Filled::of_parts(parts).unwrap();
            let covered = filled.covered(&filled.whole(), &samples).unwrap();
            covered.inside.iter().filter(|inside| **inside).count()
        };
        // Squares of 4 and 3 samples a side, of which one is common.
        for [first, second] in [[true, true], [true, false], [false, true]] {
            for rules in [
                [Fill::NonZero, Fill::EvenOdd],
                [Fill::EvenOdd, Fill::EvenOdd],
            ] {
                let parts = vec![
                    (square(1.0, 2.0, first), rules[0]),
                    (square(2.5, 1.5, second), rules[1]),
                ];
                assert_eq!(count(parts), 16 + 9 - 1);
            }
        }
        // A hole is a part of one contour only.
        let ring = square(1.0, 4.0, true).joined(&square(2.0, 1.0, true));
        assert_eq!(count(vec![(ring.clone(), Fill::EvenOdd)]), 64 - 4);
        assert_eq!(count(vec![(ring, Fill::NonZero)]), 64);
    }
}
