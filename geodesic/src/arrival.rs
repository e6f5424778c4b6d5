//! How closely the boundary that a path carries agrees with that of the other end.

use crate::error::GeodesicError;
use levelset::{
    Cause, Contour, ContourDistance, Doubt, Layer, LevelsetError, centroid, directed_hausdorff,
    facing,
};
use serde::{Deserialize, Serialize};

/// Width of slits and films, in spacings: their two sides belong to one cell.
pub(crate) const WIDTH: f64 = 1.0;
/// Longest pieces of the carried boundary, in spacings: a cell that is stretched carries longer ones, of which
/// each would count as a whole as a part of a slit or not.
const LONGEST: f64 = 0.5;
/// Distance of a slit or film from the boundary of the other end, in spacings: closer ones are parts
/// of that boundary.
const APART: f64 = 0.5;

/// The carried boundary beside that of the other end. Lengths are in spacings of the grid.
///
/// A deformation keeps the topology of the start. Where the other end has merged parts, the carried
/// boundary has a slit inside the other end, and where it has separate parts, a film of material
/// outside of it. Both are less than a spacing wide, are reported by their lengths, and are left out of
/// the distances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arrival {
    /// The distance within which 95 % of either boundary lie from the other.
    pub percentile_95: f64,
    /// Largest distance of a point of the other end's boundary from the carried one: that of the tip
    /// of a part that is missing.
    pub missing: f64,
    /// Largest distance of a point of the carried boundary from that of the other end: that of a part
    /// that is left over.
    pub surplus: f64,
    /// Length or area of the slits, both sides together, in powers of the spacing.
    pub slits: f64,
    /// Length or area of the films.
    pub films: f64,
}

impl Arrival {
    /// Where one of both has no boundary on the grid.
    const NOTHING: Self = Self {
        percentile_95: f64::INFINITY,
        missing: f64::INFINITY,
        surplus: f64::INFINITY,
        slits: 0.0,
        films: 0.0,
    };

    /// Whether both have a boundary on the grid. Otherwise distances are infinite, and are left out of records.
    pub fn has_boundaries(&self) -> bool {
        *self != Self::NOTHING
    }

    /// Whether there is nothing to state in a record.
    #[allow(clippy::ref_option, reason = "serde asks for it")]
    pub(crate) fn is_nothing(found: &Option<Self>) -> bool {
        !found.is_some_and(|found| found.has_boundaries())
    }

    /// Returns the doubts about the arrival: boundaries apart, and parts that are missing or left over.
    pub fn doubts(&self) -> Vec<Doubt> {
        let doubts = [
            Doubt::check(Cause::PathBoundary, self.percentile_95),
            Doubt::check(Cause::PathParts, self.missing.max(self.surplus)),
        ];
        doubts.into_iter().flatten().collect()
    }

    /// Returns the doubt about the Dice overlap of an end whose boundaries have this mean distance, in spacings. The
    /// resolution of the grid explains a low one only if nothing was left out of that distance: slits and films have a volume.
    pub fn doubt_of_overlap(found: Option<Self>, dice: f64, mean_distance: f64) -> Option<Doubt> {
        let layers = found.map_or(0.0, |found| found.slits + found.films);
        let distance = if layers > 0.0 {
            f64::INFINITY
        } else {
            mean_distance
        };
        Doubt::overlap(Cause::PathEnd, dice, distance)
    }

    /// The worse of those at both ends of a path.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            percentile_95: self.percentile_95.max(other.percentile_95),
            missing: self.missing.max(other.missing),
            surplus: self.surplus.max(other.surplus),
            slits: self.slits + other.slits,
            films: self.films + other.films,
        }
    }

    /// Compares the carried boundary with that of the other end.
    pub(crate) fn new<const D: usize>(
        carried: &Contour<D>,
        end: &Contour<D>,
        spacing: f64,
    ) -> Result<Self, GeodesicError> {
        match compare(carried, end, spacing) {
            Err(LevelsetError::EmptyContour) => Ok(Self::NOTHING),
            found => Ok(found?),
        }
    }
}

/// A piece of the carried boundary that is pressed against another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pressed {
    /// What is left between them.
    pub layer: Layer,
    /// Index of the other piece.
    pub other: usize,
}

/// For every piece of the carried boundary what it is pressed against, if it belongs to a slit inside of
/// the other end or to a film outside.
pub(crate) fn pressed<const D: usize>(
    carried: &Contour<D>,
    end: &Contour<D>,
    spacing: f64,
) -> Result<Vec<Option<Pressed>>, LevelsetError> {
    let at_end = ContourDistance::new(end)?;
    let all = facing(carried, WIDTH * spacing)?
        .into_iter()
        .zip(carried.all_corners());
    Ok(all
        .map(|(found, corners)| {
            // Positive inside the other end.
            let depth = at_end.signed_distance(centroid(&corners)) / spacing;
            let layer = if depth > APART {
                Layer::Slit
            } else if depth < -APART {
                Layer::Film
            } else {
                return None;
            };
            let other = found.across(layer)?;
            Some(Pressed { layer, other })
        })
        .collect())
}

fn compare<const D: usize>(
    carried: &Contour<D>,
    end: &Contour<D>,
    spacing: f64,
) -> Result<Arrival, LevelsetError> {
    let carried = &carried.refined(LONGEST * spacing);
    let pressed = pressed(carried, end, spacing)?;
    let part = |layer: Option<Layer>| {
        let all = carried.simplices().iter().zip(&pressed);
        let kept = all.filter(|(_, found)| found.map(|f| f.layer) == layer);
        Contour::new(carried.points().to_vec(), kept.map(|(s, _)| *s).collect())
    };
    let open = part(None)?;
    let there = directed_hausdorff(&open, end)?;
    let back = directed_hausdorff(end, &open)?;
    let size = |layer: Layer| -> Result<f64, LevelsetError> {
        Ok(part(Some(layer))?.perimeter() / spacing.powi(D as i32 - 1))
    };
    Ok(Arrival {
        percentile_95: there.percentile_95.max(back.percentile_95) / spacing,
        missing: back.maximum / spacing,
        surplus: there.maximum / spacing,
        slits: size(Layer::Slit)?,
        films: size(Layer::Film)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::{Grid, ScalarField};
    use levelset::{BoxEdge, contour};

    /// Spacing in which the distances are measured; the contours are those of a finer grid.
    const SPACING: f64 = 1.0 / 32.0;

    fn outline(u: impl Fn(f64, f64) -> f64 + Sync) -> Contour<2> {
        let field = ScalarField::from_fn(Grid::cube(513), |[x, y]| [u(x - 0.5, y - 0.5)]);
        contour(&field, 0.0, BoxEdge::Open).unwrap()
    }

    fn compare(carried: &Contour<2>, end: &Contour<2>) -> Arrival {
        Arrival::new(carried, end, SPACING).unwrap()
    }

    fn ring(x: f64, y: f64) -> f64 {
        0.1 - (x.hypot(y) - 0.3).abs()
    }

    #[test]
    fn a_cut_ring_arrives_at_a_ring_and_the_cut_is_reported() {
        let cut = outline(|x, y| {
            let gap = y.abs() - 0.25 * SPACING;
            ring(x, y).min(if x > 0.0 { gap } else { f64::INFINITY })
        });
        let found = compare(&cut, &outline(ring));
        // Both sides, less half a spacing at each of its ends.
        let length = 2.0 * (0.2 / SPACING - 2.0 * APART);
        assert!((found.slits - length).abs() < 0.4, "{found:?}");
        assert_eq!(found.films, 0.0);
        assert!(
            found.percentile_95 < 0.1 && found.missing < 0.5,
            "{found:?}"
        );
        assert!(found.surplus < 0.8, "{found:?}");
    }

    #[test]
    fn a_film_between_two_disks_is_reported() {
        let disks = |x: f64, y: f64| 0.15 - (x.abs() - 0.25).hypot(y);
        let joined =
            outline(|x, y| disks(x, y).max((0.25 * SPACING - y.abs()).min(0.25 - x.abs())));
        let found = compare(&joined, &outline(disks));
        assert!(
            found.films > 2.0 * (0.2 / SPACING - 2.0 * APART) - 0.4,
            "{found:?}"
        );
        assert_eq!(found.slits, 0.0);
        assert!(
            found.percentile_95 < 0.5 && found.missing < 0.5,
            "{found:?}"
        );
    }

    /// A limb that has vanished may lie beside the boundary: its inner side faces that boundary across a gap of
    /// the outside, too.
    #[test]
    fn a_film_beside_the_boundary_has_two_sides() {
        let square = |x: f64, y: f64| 0.2 - x.abs().max(y.abs());
        let limb = |x: f64, y: f64| {
            let across = 0.1 * SPACING - (x - 0.2 - 0.8 * SPACING).abs();
            across.min(0.1 - y.abs())
        };
        let both = outline(|x, y| square(x, y).max(limb(x, y)));
        let found = compare(&both, &outline(square));
        // But for its ends, whose sides face each other from a width on.
        let length = 2.0 * 0.2 / SPACING;
        assert!((found.films - length).abs() < 0.8, "{found:?}");
        assert_eq!(found.slits, 0.0);
    }

    #[test]
    fn a_limb_that_is_missing_or_left_over_has_its_length() {
        let disk = |x: f64, y: f64| 0.2 - x.hypot(y);
        let with_arm = |x: f64, y: f64| disk(x, y).max((0.05 - y.abs()).min(x).min(0.4 - x));
        let (disk, arm) = (outline(disk), outline(with_arm));
        let length = 0.2 / SPACING;
        let missing = compare(&disk, &arm);
        assert!((missing.missing - length).abs() < 0.3, "{missing:?}");
        assert!(missing.percentile_95 > 3.0, "{missing:?}");
        let left = compare(&arm, &disk);
        assert!((left.surplus - length).abs() < 0.3, "{left:?}");
        assert!(left.missing < 2.0, "{left:?}");
        assert_eq!((left.films, left.slits), (0.0, 0.0));
    }

    #[test]
    fn without_a_boundary_nothing_arrives() {
        let ring = outline(ring);
        let found = compare(&Contour::default(), &ring);
        assert_eq!(found, Arrival::NOTHING);
        assert_eq!(compare(&ring, &Contour::default()), Arrival::NOTHING);
    }
}
