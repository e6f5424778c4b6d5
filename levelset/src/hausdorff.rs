//! Distances between two boundaries.

use fe_grid::{compiled_once, mutant, parallel};

use crate::contour::Contour;
use crate::distance::ContourDistance;
use crate::error::LevelsetError;
use crate::search::{Found, PACKET};
use crate::vector::{area_normal, norm, sub};
use serde::Serialize;

/// Tolerance of the maximum, as a fraction of the diameter of the first boundary.
const TOLERANCE: f64 = 1e-6;
/// Fraction of a boundary that lies within the reported percentile.
const PERCENTILE: f64 = 0.95;
/// Maximal number of bisections of one segment or triangle, a bound on the work: 2^-24 of its
/// length, or an area of 2^-24, is below the tolerance for every grid that fits in memory.
const MAX_HALVINGS: u32 = 24;
/// Number of points searched for by one thread at a time.
const RUN: usize = 64 * PACKET;

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
    let (to_from, to_to) = (ContourDistance::new(from)?, ContourDistance::new(to)?);
    Ok(directed(from, &to_from, &to_to))
}

fn hausdorff_in<const D: usize>(
    a: &Contour<D>,
    b: &Contour<D>,
) -> Result<Hausdorff, LevelsetError> {
    let (to_a, to_b) = (ContourDistance::new(a)?, ContourDistance::new(b)?);
    let (there, back) = (directed(a, &to_a, &to_b), directed(b, &to_b, &to_a));
    Ok(Hausdorff {
        maximum: there
            .maximum
            .max(mutant!(back.maximum, HausdorffDirected => 0.0)),
        percentile_95: there.percentile_95.max(back.percentile_95),
        mean: there.mean.max(back.mean),
    })
}

fn directed<const D: usize>(
    contour: &Contour<D>,
    from: &ContourDistance<D>,
    to: &ContourDistance<D>,
) -> Hausdorff {
    // In the order of the tree, in which neighbours are adjacent.
    let corners = from.tree().all_corners();
    // A contour of degenerate simplices still has points: all have equal weight.
    let floor = if contour.perimeter() > 0.0 { 0.0 } else { 1.0 };
    let centroid = |c: &[[f64; D]; D]| -> [f64; D] {
        std::array::from_fn(|k| c.iter().map(|p| p[k]).sum::<f64>() / D as f64)
    };
    let centroids: Vec<_> = corners.iter().map(centroid).collect();
    let mut samples: Vec<(f64, f64)> = find_all(to, &centroids)
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
        maximum: farthest(contour, from, to),
        percentile_95,
        mean,
    }
}

/// Finds the simplices nearest to many points, ordered such that neighbours are adjacent.
fn find_all<const D: usize>(to: &ContourDistance<D>, points: &[[f64; D]]) -> Vec<Found> {
    let mut found = vec![Found::default(); points.len()];
    parallel::for_each_chunk(&mut found, RUN, 1, &|run, found| {
        let mut guess = 0;
        let packets = points[run * RUN..].chunks(PACKET);
        for (points, found) in packets.zip(found.chunks_mut(PACKET)) {
            to.tree().nearest(&points[..found.len()], guess, found);
            guess = found[0].stored;
        }
    });
    found
}

/// Computes the largest distance of any point of `contour` by branch and bound. The distance to a
/// fixed convex simplex is a convex function, hence on a piece at most its maximum over the
/// corners; so is the distance to all simplices.
fn farthest<const D: usize>(
    contour: &Contour<D>,
    from: &ContourDistance<D>,
    to: &ContourDistance<D>,
) -> f64 {
    let tree = from.tree();
    let ids = |stored: usize| contour.simplices()[tree.origin(stored)].map(|c| c as usize);
    // Every corner once, in the order of the tree.
    let mut place = vec![usize::MAX; contour.points().len()];
    let mut points = Vec::new();
    for c in (0..tree.all_corners().len()).flat_map(ids) {
        if place[c] == usize::MAX {
            place[c] = points.len();
            points.push(contour.points()[c]);
        }
    }
    let nearest = find_all(to, &points);
    let start = nearest
        .iter()
        .map(|found| found.distance)
        .fold(0.0, f64::max);
    let search = Search {
        to,
        tolerance: TOLERANCE * diameter(contour),
    };
    let mut maxima = vec![start; tree.all_corners().len()];
    parallel::for_each_mut(&mut maxima, 1, &|i, maximum| {
        let ends = ids(i).map(|c| nearest[place[c]].stored);
        *maximum = search.refine(&tree.all_corners()[i], &ends, start, MAX_HALVINGS);
    });
    maxima.into_iter().fold(start, f64::max)
}

struct Search<'a, const D: usize> {
    to: &'a ContourDistance<D>,
    tolerance: f64,
}

impl<const D: usize> Search<'_, D> {
    /// Returns the largest distance found on a piece, or `best` if that is larger. `ends` are the
    /// simplices nearest to the corners.
    fn refine(&self, corners: &[[f64; D]; D], ends: &[usize; D], best: f64, halvings: u32) -> f64 {
        let enough = best + self.tolerance;
        if halvings == 0 || ends.iter().any(|&end| self.bound(corners, end) <= enough) {
            return best;
        }
        let (i, j) = longest_edge(corners);
        let middle = std::array::from_fn(|k| 0.5 * (corners[i][k] + corners[j][k]));
        let found = self.to.find(&middle);
        let mut best = best.max(found.distance);
        for replaced in [i, j] {
            let (mut corners, mut ends) = (*corners, *ends);
            corners[replaced] = middle;
            ends[replaced] = found.stored;
            best = self.refine(&corners, &ends, best, halvings - 1);
        }
        best
    }

    /// Returns the largest distance of the corners from one simplex of the other boundary.
    fn bound(&self, corners: &[[f64; D]; D], simplex: usize) -> f64 {
        let squares = corners
            .iter()
            .map(|c| self.to.tree().closest(simplex, c).distance_squared);
        squares.fold(0.0, f64::max).sqrt()
    }
}

fn longest_edge<const D: usize>(corners: &[[f64; D]; D]) -> (usize, usize) {
    let mut best = (0, 1, -1.0);
    for i in 0..D {
        for j in 0..i {
            let length = norm(&sub(&corners[i], &corners[j]));
            if length > best.2 {
                best = (j, i, length);
            }
        }
    }
    (best.0, best.1)
}

fn diameter<const D: usize>(contour: &Contour<D>) -> f64 {
    let mut sum = 0.0;
    for k in 0..D {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for p in contour.points() {
            low = low.min(p[k]);
            high = high.max(p[k]);
        }
        sum += (high - low).powi(2);
    }
    sum.sqrt()
}
