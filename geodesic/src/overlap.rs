//! Overlap of the deformed start shape with the end shape.

use crate::end_mismatch::{EndMismatch, LatticeOverlap};
use crate::error::GeodesicError;
use crate::level_sets::compose;
use crate::shape::{Known, Shape, ShapeOnGrid, union_of};
use fe_grid::{Field, Grid, InverseDeformation, ScalarField};
use levelset::{BoxEdge, Compact, Contour, ContourDistance, LevelsetError, contour, hausdorff};

/// Dice overlap at which the end shape counts as reached.
const REACHED_DICE: f64 = 0.95;
/// Mean distance of the boundaries, in spacings, up to which the end shape counts as reached for
/// any overlap: for thin shapes, and for volumes on coarse grids, an offset of the boundary by a
/// fraction of a cell reduces the overlap by a tenth.
const REACHED_GAP: f64 = 0.25;

/// Distance of the boundaries, in spacings, up to which the end shape counts as reached, on 95 % of
/// their lengths or areas: parts that are squeezed to slivers, or holes that are closed to slits,
/// have little volume but a boundary.
const REACHED_BOUNDARY: f64 = 3.0;

/// Returns whether an overlap, or a mean distance of the boundaries, suffices for a shape to count
/// as reached, and most of the boundaries are close.
pub(crate) fn is_reached(dice: f64, gap: f64, boundary: Option<f64>) -> bool {
    let close = boundary.is_none_or(|distance| distance <= REACHED_BOUNDARY);
    (dice >= REACHED_DICE || gap <= REACHED_GAP) && close
}

/// Returns the smallest of several overlaps.
pub(crate) fn worst(overlaps: &[f64]) -> f64 {
    overlaps.iter().copied().fold(1.0, f64::min)
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
    /// Distance between the boundaries that is not exceeded on 95 % of each, in spacings; paths of
    /// one domain and fully visible shapes only.
    pub boundary: Option<f64>,
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
    /// Returns whether every component of the end shape counts as reached.
    pub fn reached(&self) -> bool {
        is_reached(worst(&self.forwards), self.gap, self.boundary)
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
        all.fold(x, |y, displacement| image(displacement, y))
    };
    let mut found = Overlaps {
        forwards: Vec::new(),
        backwards: pulled_overlaps(&start, &end, carry),
        gap: 0.0,
        boundary: None,
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
    let visible = [from, to].map(|shape| matches!(shape.known(), Known::Everywhere));
    let (from, to) = (from.on_grid(&grid), to.on_grid(&grid));
    let step = Compact::new(SHARP * grid.spacing())?;
    let backwards = pulled_overlaps(&from, &to, |x| image(deformation, x));
    let mut forwards = Vec::new();
    let mut gap: f64 = 0.0;
    let boundary = match visible {
        [true, true] => Some(boundary_distance(&from, &to, deformation)?),
        _ => None,
    };
    let visible = to.visibility();
    let found = EndMismatch::new(&from, &to, step).overlaps(deformation.as_slice());
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
        gap = gap.max(distance / grid.spacing());
    }
    Ok(Overlaps {
        forwards,
        backwards,
        gap,
        boundary,
    })
}

/// Returns a boundary under a deformation.
pub(crate) fn moved<const D: usize>(
    outline: &Contour<D>,
    displacement: &Field<f64, D, D>,
) -> Contour<D> {
    outline.map(|p| image(displacement, p))
}

/// Returns the image of a point under a deformation.
fn image<const D: usize>(displacement: &Field<f64, D, D>, point: [f64; D]) -> [f64; D] {
    let u: [f64; D] = displacement.sample(point);
    std::array::from_fn(|k| point[k] + u[k])
}

/// Returns the 95th percentile of the distance between the boundaries of a deformed shape and of
/// another, in spacings; infinite if one has no boundary on the grid.
fn boundary_distance<const D: usize>(
    from: &ShapeOnGrid<D>,
    to: &ShapeOnGrid<D>,
    deformation: &Field<f64, D, D>,
) -> Result<f64, GeodesicError> {
    let outline =
        |shape: &ShapeOnGrid<D>| contour(&union_of(&shape.components), 0.0, BoxEdge::Open);
    let carried = moved(&outline(from)?, deformation);
    match hausdorff(&carried, &outline(to)?) {
        Ok(found) => Ok(found.percentile_95 / deformation.grid().spacing()),
        Err(LevelsetError::EmptyContour) => Ok(f64::INFINITY),
        Err(error) => Err(error.into()),
    }
}

/// Returns the length or area of the visible part of a boundary.
fn visible_boundary<const D: usize>(
    boundary: &Contour<D>,
    weight: Option<&ScalarField<f64, D>>,
) -> f64 {
    let Some(weight) = weight else {
        return boundary.perimeter();
    };
    let seen = boundary.part(|corners| {
        let middle = std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / D as f64);
        weight.sample(middle)[0] >= 0.5
    });
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

    #[test]
    fn a_fraction_of_a_cell_is_reached_and_a_missing_limb_is_not() {
        assert!(is_reached(0.96, 1.0, None) && is_reached(0.9, 0.2, Some(1.0)));
        assert!(!is_reached(0.96, 0.2, Some(10.0)));
        let grid = Grid::cube(65);
        let arm = |length: f64| {
            ScalarField::<f64, 2>::from_fn(grid, move |[x, y]| {
                [(0.05 - (y - 0.5).abs()).min(length - x).min(x - 0.1)]
            })
        };
        let found = common(&arm(0.7), &arm(0.9), None);
        assert!(!is_reached(found.dice, found.gap, None));
        let nothing = ScalarField::<f64, 2>::zeros(grid);
        let found = common(&arm(0.7), &arm(0.9), Some(&nothing));
        assert!(!is_reached(found.dice, found.gap, None));
    }
}
