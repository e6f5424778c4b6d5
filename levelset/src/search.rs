//! Search in the tree of a contour for the simplices nearest to a few points.
//!
//! Neighbouring points traverse the tree together, one in each entry of a lane: a box is visited if
//! it may contain a nearer simplex for any of them. The points of one packet visit nearly the same
//! boxes, so a packet costs little more than a point.
//!
//! The result depends on the point alone, not on its neighbours nor on the width of the lanes:
//! boxes are skipped only if they are farther than the present result by more than rounding errors,
//! so the minimum of the computed distances is found in any order, and of simplices at the same
//! distance the first counts.

use fe_grid::{Element, Lane, LaneKernel, compiled_once, parallel};

use crate::bvh::Bvh;
use crate::closest::{Closest, Simplex};

/// Bound of the depth of the tree: balanced splits reach a leaf of 2^32 simplices long before.
const MAX_DEPTH: usize = 48;
/// Number of lanes processed at a time: sufficient to hide the latency of the operations.
const LANES: usize = 2;
/// Number of points processed together, which fills the widest lanes.
pub(crate) const PACKET: usize = 16;
/// Number of points searched for by one thread at a time.
pub(crate) const RUN: usize = 64 * PACKET;

/// The stored simplex nearest to a point, and its distance.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Found {
    pub(crate) distance: f64,
    pub(crate) stored: usize,
}

impl<const D: usize> Bvh<D> {
    /// Finds the simplices nearest to a few points, which should be neighbours. `guess` is a stored
    /// simplex to start from: a near one accelerates the search; it does not change the result.
    pub(crate) fn nearest(&self, points: &[[f64; D]], guess: usize, found: &mut [Found]) {
        search(self, points, guess, found);
    }

    /// Writes the squared distances of points from each of a few stored simplices.
    pub(crate) fn squares_into(
        &self,
        stored: &[u32],
        points: &[[f64; D]; PACKET],
        squares: &mut [[f64; PACKET]],
    ) {
        squares_from(self, stored, points, squares);
    }

    /// Returns the point of one stored simplex that is nearest to a point.
    pub(crate) fn closest(&self, stored: usize, point: &[f64; D]) -> Closest<f64, D> {
        closest_to(self.simplex(stored), point)
    }
}

/// Finds the simplices nearest to many points, ordered such that neighbours are adjacent.
pub(crate) fn find_all<const D: usize>(to: &Bvh<D>, points: &[[f64; D]]) -> Vec<Found> {
    let mut found = vec![Found::default(); points.len()];
    parallel::for_each_chunk(&mut found, RUN, 1, &|run, found| {
        let mut guess = 0;
        let packets = points[run * RUN..].chunks(PACKET);
        for (points, found) in packets.zip(found.chunks_mut(PACKET)) {
            to.nearest(&points[..found.len()], guess, found);
            guess = found[0].stored;
        }
    });
    found
}

compiled_once! {
    /// Finds what is nearest to each of a few points.
    fn search<'a, D>(
        tree: &'a Bvh<D>,
        points: &'a [[f64; D]],
        guess: usize,
        found: &'a mut [Found],
    ) = search_in;
}

fn search_in<const D: usize>(
    tree: &Bvh<D>,
    points: &[[f64; D]],
    guess: usize,
    found: &mut [Found],
) {
    let search = Search {
        tree,
        points,
        guess,
        found,
    };
    f64::run_kernel(search);
}

compiled_once! {
    /// The squared distances of points from a few simplices.
    fn squares_from<'a, D>(
        tree: &'a Bvh<D>,
        stored: &'a [u32],
        points: &'a [[f64; D]; PACKET],
        squares: &'a mut [[f64; PACKET]],
    ) = squares_from_in;
}

fn squares_from_in<const D: usize>(
    tree: &Bvh<D>,
    stored: &[u32],
    points: &[[f64; D]; PACKET],
    squares: &mut [[f64; PACKET]],
) {
    f64::run_kernel(Squares {
        tree,
        stored,
        points,
        out: squares,
    });
}

struct Squares<'a, const D: usize> {
    tree: &'a Bvh<D>,
    stored: &'a [u32],
    points: &'a [[f64; D]; PACKET],
    out: &'a mut [[f64; PACKET]],
}

impl<const D: usize> LaneKernel<f64> for Squares<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) {
        let mut entries = [[0.0; PACKET]; D];
        for (i, point) in self.points.iter().enumerate() {
            for k in 0..D {
                entries[k][i] = point[k];
            }
        }
        for first in (0..PACKET).step_by(L::COUNT) {
            let mut lanes = [L::zero(); D];
            for k in 0..D {
                lanes[k] = L::load(&entries[k][first..]);
            }
            for (stored, squares) in self.stored.iter().zip(self.out.iter_mut()) {
                let closest = self.tree.simplex(*stored as usize).closest(&lanes);
                closest.distance_squared.store(&mut squares[first..]);
            }
        }
    }
}

compiled_once! {
    /// The point of a simplex that is nearest to a point.
    fn closest_to<'a, D>(
        simplex: &'a Simplex<D>,
        point: &'a [f64; D],
    ) -> Closest<f64, D> = closest_to_in;
}

fn closest_to_in<const D: usize>(simplex: &Simplex<D>, point: &[f64; D]) -> Closest<f64, D> {
    f64::run_kernel(OfOne { simplex, point })
}

struct OfOne<'a, const D: usize> {
    simplex: &'a Simplex<D>,
    point: &'a [f64; D],
}

impl<const D: usize> LaneKernel<f64> for OfOne<'_, D> {
    type Output = Closest<f64, D>;

    // One number at a time, but with the fused operations of the machine.
    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) -> Closest<f64, D> {
        self.simplex.closest(self.point)
    }
}

struct Search<'a, const D: usize> {
    tree: &'a Bvh<D>,
    points: &'a [[f64; D]],
    guess: usize,
    found: &'a mut [Found],
}

impl<const D: usize> LaneKernel<f64> for Search<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(mut self) {
        if self.points.len() <= L::COUNT {
            self.search::<L, 1>();
        } else {
            self.search::<L, LANES>();
        }
    }
}

impl<const D: usize> Search<'_, D> {
    #[inline(always)]
    fn search<L: Lane<Element = f64>, const N: usize>(&mut self) {
        let groups = self.points.chunks(N * L::COUNT);
        for (points, found) in groups.zip(self.found.chunks_mut(N * L::COUNT)) {
            let mut state = State::<L, N, D>::new(points);
            state.look_at(self.tree, self.guess);
            state.walk(self.tree);
            state.store(found);
            self.guess = found[0].stored;
        }
    }
}

/// The points, and the nearest simplices found so far.
struct State<L, const N: usize, const D: usize> {
    points: [[L; D]; N],
    distance_squared: [L; N],
    /// Indices of the simplices: integers below 2^32, exact in a float.
    stored: [L; N],
}

impl<L: Lane<Element = f64>, const N: usize, const D: usize> State<L, N, D> {
    /// If there are fewer points than entries, the last point is repeated.
    #[inline(always)]
    fn new(points: &[[f64; D]]) -> Self {
        let mut state = Self {
            points: [[L::zero(); D]; N],
            distance_squared: [L::splat(f64::INFINITY); N],
            stored: [L::zero(); N],
        };
        let last = points.len() - 1;
        let mut entries = [0.0; PACKET];
        for n in 0..N {
            for k in 0..D {
                for (i, entry) in entries[..L::COUNT].iter_mut().enumerate() {
                    *entry = points[(n * L::COUNT + i).min(last)][k];
                }
                state.points[n][k] = L::load(&entries);
            }
        }
        state
    }

    /// Compares with one simplex.
    #[inline(always)]
    fn look_at(&mut self, tree: &Bvh<D>, stored: usize) {
        let simplex = tree.simplex(stored);
        let number = L::splat(stored as f64);
        for n in 0..N {
            let (old, known) = (self.distance_squared[n], self.stored[n]);
            let new = simplex.closest(&self.points[n]).distance_squared;
            let first = L::select(old.less(new), known, number.min(known));
            self.stored[n] = L::select(new.less(old), number, first);
            self.distance_squared[n] = new.min(old);
        }
    }

    #[inline(always)]
    fn walk(&mut self, tree: &Bvh<D>) {
        let mut stack = [(0u32, [L::zero(); N]); MAX_DEPTH];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (index, bounds) = stack[height];
            if !self.may_hold_nearer(&bounds) {
                continue;
            }
            let node = tree.node(index);
            if node.count > 0 {
                let first = node.first as usize;
                for stored in first..first + node.count as usize {
                    self.look_at(tree, stored);
                }
                continue;
            }
            let left = (index + 1, self.bounds(tree, index + 1));
            let right = (node.first, self.bounds(tree, node.first));
            // Nearer boxes first; neighbours mostly agree on which that is.
            let turn = L::any(right.1[0].less(left.1[0]));
            let (near, far) = if turn { (right, left) } else { (left, right) };
            stack[height] = far;
            stack[height + 1] = near;
            height += 2;
        }
    }

    /// Computes lower bounds of the squared distances of the contents of a node.
    #[inline(always)]
    fn bounds(&self, tree: &Bvh<D>, node: u32) -> [L; N] {
        let bounds = &tree.node(node).bounds;
        let mut squares = [L::zero(); N];
        for n in 0..N {
            squares[n] = bounds.distance_squared(&self.points[n]);
        }
        squares
    }

    /// Bounds are compared with a little more than the distances, at least the smallest
    /// number: ties must not be left out.
    #[inline(always)]
    fn may_hold_nearer(&self, bounds: &[L; N]) -> bool {
        let more = L::splat(1.0 + 128.0 * f64::EPSILON);
        let least = L::splat(f64::MIN_POSITIVE);
        let mut any = false;
        for n in 0..N {
            any |= L::any(bounds[n].less(self.distance_squared[n].mul_add(more, least)));
        }
        any
    }

    #[inline(always)]
    fn store(&self, found: &mut [Found]) {
        let (mut distances, mut stored) = ([0.0; PACKET], [0.0; PACKET]);
        for n in 0..N {
            self.distance_squared[n]
                .sqrt()
                .store(&mut distances[n * L::COUNT..]);
            self.stored[n].store(&mut stored[n * L::COUNT..]);
        }
        for (i, out) in found.iter_mut().enumerate() {
            *out = Found {
                distance: distances[i],
                stored: stored[i] as usize,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::SimdLevel;
    use proptest::prelude::*;

    /// Finds the first of the nearest simplices by comparing all of them.
    fn plain<const D: usize>(tree: &Bvh<D>, point: &[f64; D]) -> (f64, usize) {
        let mut best = (f64::INFINITY, 0);
        for stored in 0..tree.all_corners().len() {
            let square = tree.closest(stored, point).distance_squared;
            if square < best.0 {
                best = (square, stored);
            }
        }
        (best.0.sqrt(), best.1)
    }

    /// Corners on a lattice: shared corners, simplices without length or area, and points in
    /// between that are equally far from many of them.
    fn check<const D: usize>(numbers: &[u8], guess: usize) -> Result<(), TestCaseError> {
        let lattice: Vec<[f64; D]> = numbers
            .chunks_exact(D)
            .map(|c| std::array::from_fn(|k| 0.3 * f64::from(c[k]) - 0.4))
            .collect();
        let simplices: Vec<[[f64; D]; D]> = lattice
            .chunks_exact(D)
            .map(|c| std::array::from_fn(|i| c[i]))
            .collect();
        let tree = Bvh::new(&simplices);
        let points: Vec<[f64; D]> = lattice.iter().map(|p| p.map(|x| 0.5 * x)).collect();
        for level in [SimdLevel::Scalar, SimdLevel::Wide256, SimdLevel::Widest] {
            let mut found = vec![Found::default(); points.len()];
            let search = Search {
                tree: &tree,
                points: &points,
                guess: guess % simplices.len(),
                found: &mut found,
            };
            f64::dispatch(level, search);
            for (point, found) in points.iter().zip(&found) {
                let (distance, stored) = plain(&tree, point);
                prop_assert_eq!(found.distance.to_bits(), distance.to_bits());
                prop_assert_eq!(found.stored, stored);
            }
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn what_is_found_depends_on_the_point_alone(
            numbers in prop::collection::vec(0u8..6, 9..400),
            guess in 0usize..100,
        ) {
            check::<2>(&numbers, guess)?;
            check::<3>(&numbers, guess)?;
        }
    }
}
