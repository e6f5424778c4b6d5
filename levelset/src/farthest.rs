//! The point of a boundary that is farthest from another one, by branch and bound.
//!
//! The distance to a convex simplex is a convex function, hence on a part of a boundary at most its
//! maximum over the corners; so is the distance to all simplices. A piece is divided into parts, and
//! each takes the simplex that bounds it best among those nearest to the corners of the piece: this
//! costs no search.
//!
//! All pieces that may have the farthest point are halved in rounds, with one largest distance for all:
//! where many points are nearly as far, as between boundaries of constant distance, the largest of them
//! excludes most others.

use fe_grid::parallel;

use crate::bvh::Bvh;
use crate::contour::Contour;
use crate::search::{Found, PACKET, RUN, find_all};
use crate::vector::{norm, sub};

/// Tolerance of the maximum, as a fraction of the diameter of the first boundary.
const TOLERANCE: f64 = 1e-6;
/// Maximal number of bisections of one segment or triangle, a bound on the work: 2^-24 of its
/// length, or an area of 2^-24, is below the tolerance for every grid that fits in memory.
const MAX_HALVINGS: u32 = 24;
/// Largest number of pieces that are halved in a round, a bound on the memory.
const BLOCK: usize = 1 << 16;
/// Number of simplices that bound the distances of a piece.
const ENDS: usize = 4;

/// Computes the largest distance of any point of `contour` from the simplices of another, which
/// `centroids` has of its centroids, in the order of its tree.
pub(crate) fn farthest<const D: usize>(
    contour: &Contour<D>,
    (tree, centroids): (&Bvh<D>, &[Found]),
    to: &Bvh<D>,
) -> f64 {
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
    let whole = |(i, &corners): (usize, &[[f64; D]; D])| {
        let mut ends = [centroids[i].stored as u32; ENDS];
        for (end, corner) in ends.iter_mut().zip(ids(i)) {
            *end = nearest[place[corner]].stored as u32;
        }
        Piece {
            corners,
            ends,
            bound: f64::INFINITY,
            halvings: 0,
        }
    };
    let pieces = tree.all_corners().iter().enumerate().map(whole).collect();
    let tolerance = TOLERANCE * diameter(contour);
    let lattice = Lattice::new();
    let mut best = largest(centroids, largest(&nearest, 0.0));
    let mut waiting = bounded((to, &lattice), pieces, best + tolerance);
    while !waiting.is_empty() {
        let mut block = waiting.split_off(waiting.len().saturating_sub(BLOCK));
        block.retain(|piece| piece.bound > best + tolerance && piece.halvings < MAX_HALVINGS);
        let middles: Vec<_> = block.iter().map(Piece::middle).collect();
        let found = find_all(to, &middles);
        best = largest(&found, best);
        let halves = block.iter().zip(&found);
        let halves = halves
            .flat_map(|(piece, found)| piece.halves(found))
            .collect();
        waiting.extend(bounded((to, &lattice), halves, best + tolerance));
    }
    best
}

fn largest(found: &[Found], start: f64) -> f64 {
    found
        .iter()
        .map(|found| found.distance)
        .fold(start, f64::max)
}

/// The pieces that may have a point that is farther than `enough`, with their bounds.
fn bounded<const D: usize>(
    (to, lattice): (&Bvh<D>, &Lattice<D>),
    mut pieces: Vec<Piece<D>>,
    enough: f64,
) -> Vec<Piece<D>> {
    parallel::for_each_chunk(&mut pieces, RUN, 1, &|_, pieces| {
        for piece in pieces {
            piece.bound = piece.bound.min(piece.simple_bound(to, enough));
            if piece.bound > enough {
                piece.bound = piece.bound.min(lattice.bound(to, piece));
            }
        }
    });
    pieces.retain(|piece| piece.bound > enough);
    pieces
}

/// A part of a segment or triangle.
#[derive(Clone, Copy)]
struct Piece<const D: usize> {
    corners: [[f64; D]; D],
    /// The stored simplices nearest to the corners, and then others that are near.
    ends: [u32; ENDS],
    /// No point of the piece is farther from the other boundary.
    bound: f64,
    halvings: u32,
}

impl<const D: usize> Piece<D> {
    /// The bound by one simplex for the whole piece, the first that is low enough.
    fn simple_bound(&self, to: &Bvh<D>, enough: f64) -> f64 {
        let mut bound = f64::INFINITY;
        for end in &self.ends[..D] {
            let square = |c| to.closest(*end as usize, c).distance_squared;
            let largest = self.corners.iter().map(square).fold(0.0, f64::max);
            bound = bound.min(largest.sqrt());
            if bound <= enough {
                break;
            }
        }
        bound
    }

    /// The middle of the longest edge.
    fn middle(&self) -> [f64; D] {
        let (i, j) = longest_edge(&self.corners);
        std::array::from_fn(|k| 0.5 * (self.corners[i][k] + self.corners[j][k]))
    }

    /// Both halves; `found` is nearest to the middle of the longest edge.
    fn halves(&self, found: &Found) -> [Self; 2] {
        let (i, j) = longest_edge(&self.corners);
        let middle = self.middle();
        [i, j].map(|replaced| {
            let mut half = *self;
            half.corners[replaced] = middle;
            // The last one is the least near.
            half.ends[D..].rotate_right(1);
            half.ends[D] = self.ends[replaced];
            half.ends[replaced] = found.stored as u32;
            half.halvings += 1;
            half
        })
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

/// Points of a simplex in a regular lattice, and the parts between them. There are at most as many
/// points as are processed together.
struct Lattice<const D: usize> {
    /// Barycentric weights; beyond the points those of the last again.
    weights: [[f64; D]; PACKET],
    parts: Vec<[usize; D]>,
}

impl<const D: usize> Lattice<D> {
    fn new() -> Self {
        let side = if D == 2 { PACKET - 1 } else { 4 };
        let points = compositions::<D>(side);
        let place = |point: [usize; D]| points.iter().position(|p| *p == point).unwrap_or(0);
        let mut parts = Vec::new();
        for low in compositions::<D>(side - 1) {
            parts.push(std::array::from_fn(|k| place(raised(low, &[k]))));
        }
        // Between those of a triangle, others that are turned.
        for low in compositions::<D>(side - 2).into_iter().filter(|_| D == 3) {
            parts.push(std::array::from_fn(|k| {
                place(raised(low, &[k, (k + 1) % D]))
            }));
        }
        let weights = std::array::from_fn(|i| {
            points[i.min(points.len() - 1)].map(|w| w as f64 / side as f64)
        });
        Self { weights, parts }
    }

    /// A distance that no point of a piece exceeds.
    fn bound(&self, to: &Bvh<D>, piece: &Piece<D>) -> f64 {
        let corners = &piece.corners;
        let points = self.weights.map(|w| {
            std::array::from_fn(|axis| (0..D).map(|k| w[k] * corners[k][axis]).sum::<f64>())
        });
        let mut squares = [[0.0; PACKET]; ENDS];
        to.squares_into(&piece.ends, &points, &mut squares);
        let of_part = |part: &[usize; D]| {
            let largest =
                |squares: &[f64; PACKET]| part.iter().map(|&i| squares[i]).fold(0.0, f64::max);
            squares.iter().map(largest).fold(f64::INFINITY, f64::min)
        };
        self.parts.iter().map(of_part).fold(0.0, f64::max).sqrt()
    }
}

/// All sequences of numbers with this sum.
fn compositions<const D: usize>(sum: usize) -> Vec<[usize; D]> {
    let mut all = Vec::new();
    let n = (sum + 1).pow(D as u32 - 1);
    for code in 0..n {
        let mut entries = [0; D];
        let (mut rest, mut left) = (code, Some(sum));
        for entry in &mut entries[1..] {
            *entry = rest % (sum + 1);
            rest /= sum + 1;
            left = left.and_then(|left| left.checked_sub(*entry));
        }
        if let Some(left) = left {
            entries[0] = left;
            all.push(entries);
        }
    }
    all
}

/// The sequence with one more at some places.
fn raised<const D: usize>(mut entries: [usize; D], places: &[usize]) -> [usize; D] {
    for &place in places {
        entries[place] += 1;
    }
    entries
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::TestCaseError;

    use super::*;
    use crate::hausdorff;

    /// The distance of a point from the nearest of all simplices, one after the other.
    fn plain<const D: usize>(to: &Contour<D>, point: &[f64; D]) -> f64 {
        let distance = |corners: [[f64; D]; D]| {
            Bvh::new(&[corners])
                .closest(0, point)
                .distance_squared
                .sqrt()
        };
        to.all_corners().map(distance).fold(f64::INFINITY, f64::min)
    }

    /// The distances of points of a fine lattice on every simplex, by a double loop.
    fn sampled<const D: usize>(from: &Contour<D>, to: &Contour<D>) -> (f64, f64) {
        const SIDE: usize = 12;
        let (mut farthest, mut spacing) = (0.0f64, 0.0f64);
        for corners in from.all_corners() {
            for weights in compositions::<D>(SIDE) {
                let point = std::array::from_fn(|axis| {
                    let part = |k: usize| weights[k] as f64 / SIDE as f64 * corners[k][axis];
                    (0..D).map(part).sum::<f64>()
                });
                farthest = farthest.max(plain(to, &point));
            }
            let (i, j) = longest_edge(&corners);
            spacing = spacing.max(norm(&sub(&corners[i], &corners[j])) / SIDE as f64);
        }
        (farthest, spacing)
    }

    fn check<const D: usize>(numbers: &[f64]) -> Result<(), TestCaseError> {
        let points: Vec<[f64; D]> = numbers
            .chunks_exact(D)
            .map(|c| std::array::from_fn(|k| c[k]))
            .collect();
        let half = points.len() / (2 * D);
        let simplices = |first: usize| -> Vec<[u32; D]> {
            (0..half)
                .map(|s| std::array::from_fn(|k| (D * (first + s) + k) as u32))
                .collect()
        };
        let (Ok(a), Ok(b)) = (
            Contour::new(points.clone(), simplices(0)),
            Contour::new(points.clone(), simplices(half)),
        ) else {
            return Ok(());
        };
        let found = hausdorff::directed_hausdorff(&a, &b);
        let found = found.map_err(|e| TestCaseError::fail(e.to_string()))?;
        let (sampled, spacing) = sampled(&a, &b);
        // No sample is farther, and each point is within one spacing of a sample, where the distance
        // differs by no more than that.
        let tolerance = TOLERANCE * diameter(&a) + 1e-12;
        prop_assert!(
            sampled <= found.maximum + tolerance,
            "{} {}",
            sampled,
            found.maximum
        );
        prop_assert!(found.maximum <= sampled + spacing);
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn no_point_is_farther_and_samples_are_nearly_as_far(
            numbers in prop::collection::vec(-1.0f64..1.0, 36..72),
        ) {
            check::<2>(&numbers)?;
            check::<3>(&numbers)?;
        }
    }

    #[test]
    fn parts_of_the_lattice_cover_the_simplex() {
        fn check<const D: usize>() {
            let lattice = Lattice::<D>::new();
            let area = |part: &[usize; D]| {
                norm(&crate::vector::area_normal(
                    &part.map(|i| lattice.weights[i]),
                ))
            };
            let whole: f64 = lattice.parts.iter().map(area).sum();
            let corners: [[f64; D]; D] =
                std::array::from_fn(|i| std::array::from_fn(|k| f64::from(u8::from(i == k))));
            let expected = norm(&crate::vector::area_normal(&corners));
            assert!((whole - expected).abs() < 1e-12, "{whole} {expected}");
        }
        check::<2>();
        check::<3>();
    }
}
