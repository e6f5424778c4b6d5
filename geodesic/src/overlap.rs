//! How much of the end shape a path reaches.

use crate::GeodesicError;
use crate::level_sets::compose;
use crate::shape::Shape;
use fe_grid::{Field, Grid, InverseDeformation, ScalarField};
use levelset::{BoxEdge, ContourDistance, contour};

/// Overlap with the end shape from which on it counts as reached: on coarse grids the boundary is a
/// share of a cell away from it.
pub(crate) const REACHED: f64 = 0.95;

/// The least of several overlaps.
pub(crate) fn worst(overlaps: &[f64]) -> f64 {
    overlaps.iter().copied().fold(1.0, f64::min)
}

/// Dice overlaps of every component.
pub(crate) struct Overlaps {
    /// Of the end shape with the start shape carried there.
    pub forwards: Vec<f64>,
    /// Of the start shape with the end shape pulled back.
    pub backwards: Vec<f64>,
}

impl Overlaps {
    /// The least overlap of all components with the end shape.
    pub fn worst(&self) -> f64 {
        worst(&self.forwards)
    }
}

/// The overlaps that displacements between shapes achieve, where a mismatch counts.
pub(crate) fn overlaps<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    displacements: &[Field<f64, D, D>],
    grid: Grid<D>,
) -> Result<Overlaps, GeodesicError> {
    let (start, end) = (start.on_grid(&grid), end.on_grid(&grid));
    let (seen_start, seen_end) = (start.seen(), end.seen());
    let carry = |x: [f64; D]| {
        displacements.iter().fold(x, |y, displacement| {
            let u = displacement.sample(y);
            std::array::from_fn(|k| y[k] + u[k])
        })
    };
    let mut found = Overlaps {
        forwards: Vec::new(),
        backwards: Vec::new(),
    };
    // What a hidden part is deformed to, or from, is not compared with anything.
    let seen_back = seen_end
        .as_ref()
        .map(|weight| ScalarField::from_fn(grid, |x| weight.sample(carry(x))));
    let seen_ahead = seen_start.as_ref().map(|weight| {
        let all = compose(&grid, displacements);
        let outside = if start.only_covered { 0.0 } else { 1.0 };
        InverseDeformation::new(&all).push_forward(weight, outside)
    });
    let at_start = product(seen_start, seen_back);
    let at_end = product(seen_end, seen_ahead);
    for (u, v) in start.components.iter().zip(&end.components) {
        let pulled = ScalarField::from_fn(grid, |x| v.sample(carry(x)));
        found
            .backwards
            .push(weighted_dice(&pulled, u, at_start.as_ref()));
        let carried = contour(u, 0.0, BoxEdge::Open)?.map(carry);
        let carried = ContourDistance::new(&carried)?.sample(grid);
        found
            .forwards
            .push(weighted_dice(&carried, v, at_end.as_ref()));
    }
    Ok(found)
}

/// The product of two weights; one that is missing is one.
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

/// `2 |A and B| / (|A| + |B|)` of the nodes inside, by their weights; 0 where nothing is seen.
fn weighted_dice<const D: usize>(
    a: &ScalarField<f64, D>,
    b: &ScalarField<f64, D>,
    weight: Option<&ScalarField<f64, D>>,
) -> f64 {
    let (mut both, mut sum) = (0.0, 0.0);
    for (node, (&u, &v)) in a.as_slice().iter().zip(b.as_slice()).enumerate() {
        let w = weight.map_or(1.0, |weight| weight.as_slice()[node]);
        let (in_a, in_b) = (u > 0.0, v > 0.0);
        both += if in_a && in_b { w } else { 0.0 };
        sum += w * f64::from(u8::from(in_a) + u8::from(in_b));
    }
    if sum > 0.0 { 2.0 * both / sum } else { 0.0 }
}
