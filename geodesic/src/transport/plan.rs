//! The regularised optimal transport between two clouds of points, which keeps distances within them.
//!
//! For points `x_i` and `y_j` of equal weights,
//!
//! ```text
//! sum_ij p_ij c_ij + (w/2) sum_ijkl p_ij p_kl (d(x_i, x_k) - d(y_j, y_l))^2 + eps sum_ij p_ij log p_ij,
//! c_ij = |x_i - y_j|^2 + (b(x_i) - b(y_j))^2,
//! ```
//!
//! is minimised over all plans `p` with these marginals, where `b` is the depth of a point below the boundary of its
//! shape, so that points of the boundary go to the boundary, and `d` the distance of two points within their shape:
//! where a limb bends, it goes to the same limb, though another one is nearer. The second term is linearised at the
//! last plan; the dual potentials of the linear problem are found by alternating their equations, in logarithms,
//! while `eps` falls from the square of the size of the box to that of a cell.
//!
//! Sources: Cuturi, *Sinkhorn distances: lightspeed computation of optimal transport* (2013); Schmitzer,
//! *Stabilized sparse scaling algorithms for entropy regularized transport problems* (2019), for the falling `eps`;
//! Solomon, Peyré, Kim and Sra, *Entropic metric alignment for correspondence problems* (2016), for the distances;
//! Vayer, Chapel, Flamary, Tavenard and Courty, *Fused Gromov-Wasserstein distance for structured objects* (2020), for
//! the sum of both.

use super::cloud::Cloud;
use fe_grid::{Grid, mutant, parallel};
use nalgebra::{DMatrix, DVector};

/// The square root of the first `eps`, in sides of the box.
const FIRST_WIDTH: f64 = 0.25;
/// Its factor from round to round.
const NARROWER: f64 = 0.8;
/// The last one, in cells.
const LAST_WIDTH: f64 = 0.7;
/// The weight of changes of distances within the shape.
const DISTANCES: f64 = 4.0;
/// Iterations of the potentials for every linear problem, and for the last one.
const ROUNDS: [usize; 2] = [3, 10];

/// `log mean_j exp(e_j)`.
fn log_mean_exp(exponents: impl Iterator<Item = f64> + Clone, count: usize) -> f64 {
    let largest = exponents.clone().fold(f64::MIN, f64::max);
    let sum: f64 = exponents.map(|e| (e - largest).exp()).sum();
    largest + (sum / count as f64).ln()
}

/// The new potential of every column, from that of the rows: `-eps log mean_i exp((f_i - c_ij) / eps)`.
fn potential(cost: &DMatrix<f64>, of_rows: &[f64], eps: f64) -> Vec<f64> {
    parallel::map(0..cost.ncols(), &|j| {
        let column = cost.column(j);
        let exponents = of_rows.iter().zip(&column).map(|(f, c)| (f - c) / eps);
        -eps * log_mean_exp(exponents, of_rows.len())
    })
}

/// A plan between two clouds.
pub(super) struct Coupling<'a, const D: usize> {
    clouds: [&'a Cloud<D>; 2],
    linear: DMatrix<f64>,
    /// The distances within both shapes, and the means of their squares.
    within: [DMatrix<f64>; 2],
    squares: [DVector<f64>; 2],
    plan: DMatrix<f64>,
}

impl<'a, const D: usize> Coupling<'a, D> {
    /// Computes the plan between two clouds of nodes of a grid.
    pub fn new(from: &'a Cloud<D>, to: &'a Cloud<D>, grid: &Grid<D>) -> Self {
        let last = LAST_WIDTH * grid.spacing();
        let (n, m) = (from.len(), to.len());
        let within = [from, to].map(Cloud::within);
        let mut coupling = Self {
            clouds: [from, to],
            linear: DMatrix::from_fn(n, m, |i, j| from.apart(i, to, j)),
            squares: within.each_ref().map(|d| d.map(|x| x * x).column_mean()),
            within,
            plan: DMatrix::zeros(0, 0),
        };
        let mut width = FIRST_WIDTH.max(last);
        let mut cost = coupling.linear.clone();
        let mut of_to = vec![0.0; m];
        loop {
            let at_end = width <= last;
            let eps = width * width;
            let turned = cost.transpose();
            let mut of_from = Vec::new();
            for _ in 0..ROUNDS[usize::from(at_end)] {
                of_from = potential(&turned, &of_to, eps);
                of_to = potential(&cost, &of_from, eps);
            }
            coupling.plan = plan(&cost, &of_from, &of_to, eps);
            if at_end {
                return coupling;
            }
            cost = mutant!(DISTANCES, TransportWithin => 0.0) * coupling.changes();
            cost += &coupling.linear;
            width = (NARROWER * width).max(last);
        }
    }

    /// The derivative of half of the second term by the plan: the mean squared changes of the distances of two points
    /// from all others.
    fn changes(&self) -> DMatrix<f64> {
        let mixed = &self.within[0] * (&self.plan * &self.within[1]);
        let [from, to] = &self.squares;
        mixed.map_with_location(|i, j, mixed| from[i] + to[j] - 2.0 * mixed)
    }

    /// Returns where the points of both clouds are carried: the means of the plan over the points of the other one.
    pub fn targets(&self) -> [Vec<[f64; D]>; 2] {
        let [from, to] = self.clouds;
        [means(&self.plan.transpose(), to), means(&self.plan, from)]
    }

    /// The mean squared distances of points from their targets, in space and depth, and the mean squared changes of
    /// distances within the shapes.
    pub fn costs(&self) -> [f64; 2] {
        let total = self.plan.sum();
        [&self.linear, &self.changes()].map(|cost| self.plan.dot(cost) / total)
    }
}

/// The plan of some potentials, `exp((f_i + g_j - c_ij) / eps) / (n m)`.
fn plan(cost: &DMatrix<f64>, of_rows: &[f64], of_columns: &[f64], eps: f64) -> DMatrix<f64> {
    let (n, m) = cost.shape();
    let shares = parallel::map(0..m, &|j| {
        let column = cost.column(j);
        let share = |(f, c): (&f64, &f64)| ((f + of_columns[j] - c) / eps).exp() / (n * m) as f64;
        of_rows.iter().zip(&column).map(share).collect::<Vec<_>>()
    });
    DMatrix::from_vec(n, m, shares.concat())
}

/// The means of the points of the rows for all columns of a plan.
fn means<const D: usize>(plan: &DMatrix<f64>, rows: &Cloud<D>) -> Vec<[f64; D]> {
    plan.column_iter()
        .map(|shares| {
            let (mut total, mut mean) = (0.0, [0.0; D]);
            for (share, point) in shares.iter().zip(&rows.points) {
                total += share;
                for (mean, x) in mean.iter_mut().zip(point) {
                    *mean += share * x;
                }
            }
            mean.map(|sum| sum / total)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::ScalarField;

    /// Two squares of half the distance between them: monotone in that direction, the transport moves both by the same
    /// vector, though the nearest points of the first one's target are its own.
    #[test]
    fn parts_that_overlap_others_go_to_their_own() {
        let grid = Grid::<2>::cube(33);
        let squares = |by: f64| {
            ScalarField::from_fn(grid, |[x, y]| {
                let part = |centre: f64| 0.08 - (x - centre - by).abs().max((y - 0.5).abs());
                [part(0.3).max(part(0.55))]
            })
        };
        let (from, to) = (Cloud::new(&squares(0.0)), Cloud::new(&squares(0.1875)));
        assert_eq!(from.len(), to.len());
        for (point, goal) in from
            .points
            .iter()
            .zip(&Coupling::new(&from, &to, &grid).targets()[0])
        {
            // The plan is as wide as a cell, so that corners go up to half of one to the inside.
            assert!(
                (goal[0] - point[0] - 0.1875).abs() < 0.5 * grid.spacing(),
                "{point:?} {goal:?}"
            );
            assert!((goal[1] - point[1]).abs() < 0.5 * grid.spacing());
        }
    }

    /// A trunk with a leg, and an arm whose forearm is in a range of heights.
    fn figure(grid: Grid<2>, forearm: [f64; 2]) -> ScalarField<f64, 2> {
        let boxes = [
            ([0.42, 0.58], [0.2, 0.8]),
            ([0.46, 0.54], [0.05, 0.2]),
            ([0.22, 0.54], [0.56, 0.64]),
            ([0.22, 0.3], forearm),
        ];
        ScalarField::from_fn(grid, |[x, y]| {
            let part = |(across, along): &([f64; 2], [f64; 2])| {
                let depth = |x: f64, [from, to]: [f64; 2]| (x - from).min(to - x);
                depth(x, *across).min(depth(y, *along))
            };
            [boxes.iter().map(part).fold(f64::MIN, f64::max)]
        })
    }

    /// The hand moves by nearly half the box; without distances within the shape, it goes to the trunk.
    #[test]
    fn a_hand_that_is_raised_goes_to_the_hand() {
        let grid = Grid::<2>::cube(33);
        let clouds = [[0.34, 0.64], [0.56, 0.86]].map(|arm| Cloud::new(&figure(grid, arm)));
        let found = Coupling::new(&clouds[0], &clouds[1], &grid).targets();
        let hands = [[0.25, 0.375], [0.25, 0.84375]];
        for (k, goal) in [hands[1], hands[0]].into_iter().enumerate() {
            let at_hand = |point: &[f64; 2]| *point == hands[k];
            let hand = clouds[k].points.iter().position(at_hand).unwrap();
            let missed = (0..2).map(|i| (found[k][hand][i] - goal[i]).abs());
            let missed = missed.fold(0.0, f64::max);
            // Both are the node above the end of the arm; the plan is as wide as a cell.
            assert!(missed < 1.5 * grid.spacing(), "{k} {missed}");
        }
    }
}
