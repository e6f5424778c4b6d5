//! Objects of which one has another unit of length than the others, or all have no length in millimetres.

use shapespace_input::Image;
use shapespace_input::place::extents;

use crate::error::CliError;

/// The longest sides of two objects differ by this factor at most. A smaller one would lie between the nodes of all
/// grids but the largest.
const MOST_TIMES: f64 = 100.0;
/// The longest sides that objects have, in millimetres: from a nanometre to a kilometre. Affine maps beyond are
/// mistakes, also where all inputs have the same.
const SIDES: [f64; 2] = [1e-6, 1e6];
/// Of two objects the one is wrong whose side is farther from this, in millimetres, as a factor.
const USUAL_SIDE: f64 = 50.0;
/// A unit is recognised by factors that differ from it by at most this factor.
const ABOUT: f64 = 5.0;
/// What an object is that seems so many times as long as the others: its numbers have this unit, but are taken for
/// millimetres.
const UNITS: [(f64, &str); 4] = [
    (1e-6, "kilometres"),
    (1e-3, "metres"),
    (1e3, "micrometres"),
    (1e6, "nanometres"),
];

/// Refuses objects in the world whose lengths can have no common unit, and names the one that differs most from the
/// others, and objects that are all too long or too short for anything.
///
/// # Errors
/// [`CliError::Option`].
pub(super) fn check_units<const D: usize>(images: &[Image<D>]) -> Result<(), CliError> {
    let sides = extents(images);
    let Some((outlier, usual)) = outlier(&sides) else {
        return match absurd(&sides) {
            Some(first) => Err(CliError::Option {
                option: "INPUT",
                value: format!(
                    "'{}', whose object is {:.1e} mm long,",
                    images[first].path.display(),
                    sides[first]
                ),
                remedy: "give lengths in millimetres in the header of the file, or compare shapes without their \
                         sizes by --size equal"
                    .into(),
            }),
            None => Ok(()),
        };
    };
    let (side, times) = (sides[outlier], sides[outlier] / usual);
    let (factor, which) = if times > 1.0 {
        (times, "long")
    } else {
        (times.recip(), "short")
    };
    let near = |unit: f64| (ABOUT.recip()..ABOUT).contains(&(times / unit));
    let unit = UNITS.iter().find(|(unit, _)| near(*unit));
    let mistake = unit.map_or_else(
        || "its lengths are not millimetres".into(),
        |(_, name)| format!("its lengths look like {name}"),
    );
    Err(CliError::Option {
        option: "INPUT",
        value: format!(
            "'{}', whose object is {} mm long and {} times as {which} as that of others,",
            images[outlier].path.display(),
            format_args!("{side:.1e}"),
            format_args!("{factor:.0}"),
        ),
        remedy: format!(
            "{mistake}: give them in millimetres, or compare shapes without their sizes by --size equal"
        ),
    })
}

/// The number of the side that differs most from the others as a factor, and what it should be like; none where no two
/// differ by more than [`MOST_TIMES`].
fn outlier(sides: &[f64]) -> Option<(usize, f64)> {
    let mut order: Vec<usize> = (0..sides.len()).collect();
    order.sort_by(|&i, &j| sides[i].total_cmp(&sides[j]));
    let (shortest, longest) = (*order.first()?, *order.last()?);
    if sides[longest] <= MOST_TIMES * sides[shortest] {
        return None;
    }
    // Of two there is no majority.
    let middle = match sides.len() {
        2 => USUAL_SIDE,
        n => sides[order[n / 2]],
    };
    if sides[longest] * sides[shortest] > middle * middle {
        Some((longest, sides[order[(sides.len() - 1) / 2]]))
    } else {
        Some((shortest, sides[order[sides.len() / 2]]))
    }
}

/// The number of the first side that no object has.
fn absurd(sides: &[f64]) -> Option<usize> {
    let [least, most] = SIDES;
    sides.iter().position(|side| !(least..=most).contains(side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_side_that_differs_most_is_the_outlier() {
        assert_eq!(outlier(&[]), None);
        assert_eq!(outlier(&[40.0]), None);
        assert_eq!(outlier(&[40.0, 4000.0]), None);
        assert_eq!(outlier(&[40.0, 4e7]), Some((1, 40.0)));
        assert_eq!(outlier(&[0.04, 40.0]), Some((0, 40.0)));
        assert_eq!(outlier(&[40.0, 0.04, 45.0]), Some((1, 40.0)));
        assert_eq!(outlier(&[4e4, 40.0, 45.0]), Some((0, 45.0)));
        // Alike, and absurd.
        assert_eq!(outlier(&[4e8, 4.1e8]), None);
        assert_eq!(absurd(&[4e8, 4.1e8]), Some(0));
        assert_eq!(absurd(&[40.0, f64::NAN]), Some(1));
        // A cell, and a whale.
        assert_eq!(absurd(&[1e-2, 3e4]), None);
        // The others have another unit than millimetres.
        assert_eq!(outlier(&[4e4, 40.0, 4.5e4]), Some((1, 4e4)));
    }
}
