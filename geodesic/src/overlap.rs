//! Overlap of the deformed start shape with the end shape.

use crate::arrival::Arrival;
use crate::end_mismatch::{EndMismatch, LatticeOverlap};
use crate::error::GeodesicError;
use crate::level_sets::compose;
use crate::shape::{Shape, ShapeOnGrid, union_of};
use fe_grid::{Field, Grid, InverseDeformation, ScalarField};
use levelset::criteria::RESOLVED_DISTANCE;
use levelset::{BoxEdge, Cause, Compact, Contour, ContourDistance, Doubt, LevelsetError};
use levelset::{centroid, contour, share_outside};
use serde::Serialize;

/// Dice overlap from which a path ends near the end shape.
const NEAR_DICE: f64 = 0.95;
/// Distance of the boundaries, in spacings, on 95 % of their lengths or areas, up to which it does:
/// parts that are squeezed to slivers, or holes that are closed to slits, have little volume but a
/// boundary.
const NEAR_BOUNDARY: f64 = 3.0;

/// How a path ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    /// Smallest Dice overlap of all components.
    pub dice: f64,
    /// Mean distance of the boundaries, in spacings.
    pub gap: f64,
    /// The boundaries beside each other; fully visible shapes only.
    pub arrival: Option<Arrival>,
}

impl End {
    /// Returns whether the path arrives at the end shape, but for its smallest parts: the figures are
    /// within the limits of [`Cause::PathEnd`] and [`Cause::PathBoundary`].
    pub fn reached(&self) -> bool {
        let overlap = Arrival::doubt_of_overlap(self.arrival, self.dice, self.gap);
        let boundary = self
            .arrival
            .and_then(|found| Doubt::check(Cause::PathBoundary, found.percentile_95));
        overlap.is_none() && boundary.is_none()
    }

    /// The worse of two ends.
    pub fn and(self, other: Self) -> Self {
        Self {
            dice: self.dice.min(other.dice),
            gap: self.gap.max(other.gap),
            arrival: match (self.arrival, other.arrival) {
                (Some(own), Some(other)) => Some(own.and(other)),
                _ => None,
            },
        }
    }

    /// Returns whether the path ends so close to the end shape that its length is of use.
    pub fn near(&self) -> bool {
        let overlap = Doubt::below(Cause::PathEnd, self.dice, NEAR_DICE);
        let close = self
            .arrival
            .is_none_or(|found| found.percentile_95 <= NEAR_BOUNDARY);
        close && (overlap.is_none() || self.gap <= RESOLVED_DISTANCE)
    }
}

/// Returns the smallest of several overlaps.
pub(crate) fn worst(overlaps: &[f64]) -> f64 {
    overlaps.iter().copied().fold(1.0, f64::min)
}

/// How all of a deformed shape, of which a part is hidden, agrees with the visible part of another: a
/// deformation does not restore what is hidden.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WholeOverlap {
    /// Smallest Dice overlap of all components.
    pub dice: f64,
    /// Mean distance of the boundaries, in spacings, of the component where it is largest.
    pub gap: f64,
}

impl WholeOverlap {
    /// The doubt that the deformed shapes lack what is hidden.
    pub(crate) fn doubt(&self) -> Option<Doubt> {
        Doubt::overlap(Cause::HiddenPart, self.dice, self.gap)
    }
}

/// Dice overlaps of every component.
pub(crate) struct Overlaps {
    /// Of the end shape with the deformed start shape.
    pub forwards: Vec<f64>,
    /// Of the start shape with the end shape pulled back.
    pub backwards: Vec<f64>,
    /// Mean distance between the boundaries of the end shape and of the deformed start shape, in
    /// spacings, of the component where it is largest.
    pub gap: f64,
    /// The boundaries beside each other; fully visible shapes only.
    pub arrival: Option<Arrival>,
    /// With the hidden parts of the deformed shape; one deformation of a shape that is hidden in part only.
    pub whole: Option<WholeOverlap>,
}

/// Overlap and distance of two shapes, computed from the nodes inside.
struct Common {
    /// `2 |A and B| / (|A| + |B|)`, 0 where nothing is visible.
    dice: f64,
    /// `|A xor B|` divided by the number of nodes within half a spacing of the boundary of `B`: as
    /// this band is one spacing wide, a mean distance in spacings. Infinite if no boundary is
    /// visible.
    gap: f64,
}

impl Overlaps {
    /// The worse of those at both ends of a path of a shape between them.
    pub fn and(mut self, other: &Self) -> Self {
        let least = |own: &mut [f64], other: &[f64]| {
            for (own, other) in own.iter_mut().zip(other) {
                *own = own.min(*other);
            }
        };
        least(&mut self.forwards, &other.forwards);
        least(&mut self.backwards, &other.backwards);
        let both = self.end().and(other.end());
        Self {
            gap: both.gap,
            arrival: both.arrival,
            whole: None,
            ..self
        }
    }

    /// Returns the figures by which the end of the path is judged.
    pub fn end(&self) -> End {
        End {
            dice: worst(&self.forwards),
            gap: self.gap,
            arrival: self.arrival,
        }
    }
}

/// Computes the overlaps achieved by displacements between shapes, on their visible parts.
pub(crate) fn overlaps<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    displacements: &[Field<f64, D, D>],
    grid: Grid<D>,
) -> Result<Overlaps, GeodesicError> {
    let (start, end) = (start.on_grid(&grid), end.on_grid(&grid));
    let (visible_start, visible_end) = (start.visibility(), end.visibility());
    let carry = |x: [f64; D]| {
        let all = displacements.iter();
        all.fold(x, |y, displacement| displacement.image(y))
    };
    let mut found = Overlaps {
        forwards: Vec::new(),
        backwards: pulled_overlaps(&start, &end, carry),
        gap: 0.0,
        arrival: arrival(&start, &end, carry)?,
        whole: None,
    };
    // Hidden parts, and their images, are not compared.
    let visible_ahead = visible_start.as_ref().map(|weight| {
        let all = compose(&grid, displacements);
        let outside = if start.only_covered { 0.0 } else { 1.0 };
        InverseDeformation::new(&all).push_forward(weight, outside)
    });
    let at_end = product(visible_end, visible_ahead);
    for (u, v) in start.components.iter().zip(&end.components) {
        let carried = contour(u, 0.0, BoxEdge::Open)?.map(carry);
        let carried = ContourDistance::new(&carried)?.sample(grid);
        let at_end = common(&carried, v, at_end.as_ref());
        found.forwards.push(at_end.dice);
        found.gap = found.gap.max(at_end.gap);
    }
    Ok(found)
}

/// Computes the overlaps of the components of a shape with those of another that are pulled back by
/// a map, on the parts that are visible in both.
fn pulled_overlaps<const D: usize>(
    start: &ShapeOnGrid<D>,
    end: &ShapeOnGrid<D>,
    map: impl Fn([f64; D]) -> [f64; D],
) -> Vec<f64> {
    let pull =
        |field: &ScalarField<f64, D>| ScalarField::from_fn(*field.grid(), |x| field.sample(map(x)));
    let visible = product(start.visibility(), end.visibility().as_ref().map(pull));
    let pairs = start.components.iter().zip(&end.components);
    let found = pairs.map(|(u, v)| common(&pull(v), u, visible.as_ref()).dice);
    found.collect()
}

/// Half-width of the step that measures volumes, in spacings.
const SHARP: f64 = 1e-3;

/// Computes the overlaps achieved by one deformation of the first shape, on the visible parts: at
/// points of the domain of the second shape, between which no limb is missed.
pub(crate) fn carried_overlaps<const D: usize>(
    from: &Shape<D>,
    to: &Shape<D>,
    deformation: &Field<f64, D, D>,
) -> Result<Overlaps, GeodesicError> {
    let grid = *deformation.grid();
    let (from, to) = (from.on_grid(&grid), to.on_grid(&grid));
    let backwards = pulled_overlaps(&from, &to, |x| deformation.image(x));
    let arrival = arrival(&from, &to, |x| deformation.image(x))?;
    let (forwards, gap) = covered(&from, &to, deformation)?;
    let whole = if from.hidden() {
        let (dice, gap) = covered(&from.taken_for_whole(), &to, deformation)?;
        Some(WholeOverlap {
            dice: worst(&dice),
            gap,
        })
    } else {
        None
    };
    Ok(Overlaps {
        forwards,
        backwards,
        gap,
        arrival,
        whole,
    })
}

/// Computes the overlaps of the components of a deformed shape with those of another, on the visible parts,
/// and the largest mean distance of their boundaries in spacings.
fn covered<const D: usize>(
    from: &ShapeOnGrid<D>,
    to: &ShapeOnGrid<D>,
    deformation: &Field<f64, D, D>,
) -> Result<(Vec<f64>, f64), GeodesicError> {
    let spacing = deformation.grid().spacing();
    let step = Compact::new(SHARP * spacing)?;
    let mut forwards = Vec::new();
    let mut gap: f64 = 0.0;
    let visible = to.visibility();
    let found = EndMismatch::new(from, to, step).overlaps(deformation.as_slice());
    for (
        LatticeOverlap {
            difference,
            volumes,
        },
        v,
    ) in found.into_iter().zip(&to.components)
    {
        let size = visible_boundary(&contour(v, 0.0, BoxEdge::Open)?, visible.as_ref());
        let sum = volumes[0] + volumes[1];
        forwards.push(if sum > 0.0 {
            1.0 - difference / sum
        } else {
            0.0
        });
        let distance = if size > 0.0 {
            difference / size
        } else {
            f64::INFINITY
        };
        gap = gap.max(distance / spacing);
    }
    Ok((forwards, gap))
}

/// Compares the boundary of a shape that is carried by a map with that of another; `None` if a part of
/// one is hidden.
fn arrival<const D: usize>(
    from: &ShapeOnGrid<D>,
    to: &ShapeOnGrid<D>,
    carry: impl Fn([f64; D]) -> [f64; D],
) -> Result<Option<Arrival>, GeodesicError> {
    if from.visibility().is_some() || to.visibility().is_some() {
        return Ok(None);
    }
    let outline =
        |shape: &ShapeOnGrid<D>| contour(&union_of(&shape.components), 0.0, BoxEdge::Open);
    let (start, end) = (outline(from)?, outline(to)?);
    let spacing = to.components[0].grid().spacing();
    Arrival::new(&start.map(carry), &end, spacing).map(Some)
}

/// Returns the length or area of the visible part of a boundary.
fn visible_boundary<const D: usize>(
    boundary: &Contour<D>,
    weight: Option<&ScalarField<f64, D>>,
) -> f64 {
    let Some(weight) = weight else {
        return boundary.perimeter();
    };
    let seen = boundary.part(|corners| weight.sample(centroid(corners))[0] >= 0.5);
    seen.perimeter()
}

/// Returns the product of two weights; a missing weight is one.
fn product<const D: usize>(
    a: Option<ScalarField<f64, D>>,
    b: Option<ScalarField<f64, D>>,
) -> Option<ScalarField<f64, D>> {
    match (a, b) {
        (Some(mut a), Some(b)) => {
            for (a, b) in a.as_mut_slice().iter_mut().zip(b.as_slice()) {
                *a *= b;
            }
            Some(a)
        }
        (a, b) => a.or(b),
    }
}

/// Compares two shapes, given by signed distances, with a visibility weight.
fn common<const D: usize>(
    a: &ScalarField<f64, D>,
    b: &ScalarField<f64, D>,
    weight: Option<&ScalarField<f64, D>>,
) -> Common {
    let half = 0.5 * b.grid().spacing();
    let (mut both, mut sum, mut band) = (0.0, 0.0, 0.0);
    for (node, (&u, &v)) in a.as_slice().iter().zip(b.as_slice()).enumerate() {
        let w = weight.map_or(1.0, |weight| weight.as_slice()[node]);
        let (in_a, in_b) = (u > 0.0, v > 0.0);
        both += if in_a && in_b { w } else { 0.0 };
        sum += w * f64::from(u8::from(in_a) + u8::from(in_b));
        band += if v.abs() <= half { w } else { 0.0 };
    }
    Common {
        dice: if sum > 0.0 { 2.0 * both / sum } else { 0.0 },
        gap: if band > 0.0 {
            (sum - 2.0 * both) / band
        } else {
            f64::INFINITY
        },
    }
}

/// Returns the largest share of a deformed start shape that lies outside of the box of the grid.
pub(crate) fn largest_share_outside<const D: usize>(
    start: &ScalarField<f64, D>,
    displacements: &[Field<f64, D, D>],
) -> Result<f64, GeodesicError> {
    let outline = contour(start, 0.0, BoxEdge::Closed)?;
    let mut most: f64 = 0.0;
    for displacement in displacements {
        match share_outside(&outline.displaced(displacement, 1.0), start.grid()) {
            Ok(share) => most = most.max(share),
            // A shape without a volume has none outside.
            Err(LevelsetError::EmptyContour | LevelsetError::InsideOut) => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gap_is_the_mean_distance_of_the_boundaries_in_spacings() {
        let grid = Grid::cube(129);
        let ball = |radius: f64| {
            ScalarField::<f64, 3>::from_fn(Grid::cube(65), move |x| {
                [radius - x.map(|c| (c - 0.5).powi(2)).iter().sum::<f64>().sqrt()]
            })
        };
        let disk = |radius: f64| {
            ScalarField::<f64, 2>::from_fn(grid, move |[x, y]| [radius - (x - 0.5).hypot(y - 0.5)])
        };
        let h = grid.spacing();
        // Nodes are counted, and the layer is a tenth of the radius thick: an error of some per
        // cent.
        let found = common(&disk(0.3 + 2.0 * h), &disk(0.3), None);
        assert!((found.gap - 2.0).abs() < 0.3, "{}", found.gap);
        let found = common(&ball(0.3 - 1.0 / 64.0), &ball(0.3), None);
        assert!((found.gap - 1.0).abs() < 0.15, "{}", found.gap);
    }

    fn end(dice: f64, gap: f64, percentile_95: Option<f64>) -> End {
        let arrival = percentile_95.map(|percentile_95| Arrival {
            percentile_95,
            missing: percentile_95,
            surplus: percentile_95,
            slits: 0.0,
            films: 0.0,
        });
        End { dice, gap, arrival }
    }

    #[test]
    fn a_fraction_of_a_cell_is_reached_and_a_missing_limb_is_not() {
        assert!(end(0.985, 1.0, None).reached() && end(0.9, 0.2, Some(0.4)).reached());
        assert!(!end(0.99, 0.1, Some(0.6)).reached() && !end(0.97, 0.3, None).reached());
        assert!(end(0.96, 0.3, Some(2.0)).near() && end(0.9, 0.2, Some(1.0)).near());
        assert!(!end(0.96, 0.2, Some(10.0)).near() && !end(0.9, 0.3, None).near());
        assert!(!end(f64::NAN, 0.3, None).near() && !end(0.99, 0.1, Some(f64::NAN)).near());
        let grid = Grid::cube(65);
        let arm = |length: f64| {
            ScalarField::<f64, 2>::from_fn(grid, move |[x, y]| {
                [(0.05 - (y - 0.5).abs()).min(length - x).min(x - 0.1)]
            })
        };
        let found = common(&arm(0.7), &arm(0.9), None);
        assert!(!end(found.dice, found.gap, None).near());
        let nothing = ScalarField::<f64, 2>::zeros(grid);
        let found = common(&arm(0.7), &arm(0.9), Some(&nothing));
        assert!(!end(found.dice, found.gap, None).near());
    }
}
