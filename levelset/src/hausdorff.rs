//! Distances between two boundaries.

use fe_grid::{compiled_once, mutant};

use crate::bvh::Bvh;
use crate::contour::{Contour, centroid};
use crate::distance::tree_of;
use crate::error::LevelsetError;
use crate::farthest::farthest;
use crate::search::find_all;
use crate::vector::{area_normal, norm};
use serde::Serialize;

/// Fraction of a boundary that lies within the reported percentile.
const PERCENTILE: f64 = 0.95;

/// Distances between two boundaries, in the unit of their coordinates: of [`hausdorff`] the maximum
/// over both directions, of [`directed_hausdorff`] from the first boundary to the second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hausdorff {
    /// The Hausdorff distance: the largest distance of any point of one boundary, corner or not,
    /// from the other (to 1e-6 of their diameter).
    pub maximum: f64,
    /// The distance within which 95 % of a boundary, by length or area, lies from the other.
    pub percentile_95: f64,
    /// The mean distance of the points of a boundary from the other.
    pub mean: f64,
}

compiled_once! {
    /// The symmetric Hausdorff distance of two boundaries, with its 95th percentile and the mean.
    ///
    /// Percentile and mean measure each segment or triangle at its centroid, weighted by its size.
    ///
    /// # Errors
    /// [`LevelsetError::EmptyContour`].
    pub fn hausdorff<'a, D>(
        a: &'a Contour<D>,
        b: &'a Contour<D>,
    ) -> Result<Hausdorff, LevelsetError> = hausdorff_in;
}

compiled_once! {
    /// The distances of the points of the first boundary from the second.
    ///
    /// # Errors
    /// As for [`hausdorff`].
    pub fn directed_hausdorff<'a, D>(
        from: &'a Contour<D>,
        to: &'a Contour<D>,
    ) -> Result<Hausdorff, LevelsetError> = directed_in;
}

fn directed_in<const D: usize>(
    from: &Contour<D>,
    to: &Contour<D>,
) -> Result<Hausdorff, LevelsetError> {
    let (tree, to) = (tree_of(from)?, tree_of(to)?);
    Ok(directed(from, &tree, &to))
}

fn hausdorff_in<const D: usize>(
    a: &Contour<D>,
    b: &Contour<D>,
) -> Result<Hausdorff, LevelsetError> {
    let (to_a, to_b) = (tree_of(a)?, tree_of(b)?);
    let (there, back) = (directed(a, &to_a, &to_b), directed(b, &to_b, &to_a));
    Ok(Hausdorff {
        maximum: there
            .maximum
            .max(mutant!(back.maximum, HausdorffDirected => 0.0)),
        percentile_95: there.percentile_95.max(back.percentile_95),
        mean: there.mean.max(back.mean),
    })
}

fn directed<const D: usize>(contour: &Contour<D>, tree: &Bvh<D>, to: &Bvh<D>) -> Hausdorff {
    // In the order of the tree, in which neighbours are adjacent.
    let corners = tree.all_corners();
    // A contour of degenerate simplices still has points: all have equal weight.
    let floor = if contour.perimeter() > 0.0 { 0.0 } else { 1.0 };
    let centroids: Vec<_> = corners.iter().map(centroid).collect();
    let found = find_all(to, &centroids);
    let mut samples: Vec<(f64, f64)> = found
        .iter()
        .zip(corners)
        .map(|(found, c)| (found.distance, norm(&area_normal(c)).max(floor)))
        .collect();
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = samples.iter().map(|s| s.1).sum();
    let mean = samples.iter().map(|s| s.0 * s.1).sum::<f64>() / total;
    let mut below = 0.0;
    let percentile_95 = samples
        .iter()
        .find(|s| {
            below += s.1;
            below >= PERCENTILE * total
        })
        .map_or(0.0, |s| s.0);
    Hausdorff {
        maximum: farthest(contour, (tree, &found), to),
        percentile_95,
        mean,
    }
}
