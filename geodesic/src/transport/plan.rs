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
//! Of a shape of which a part is hidden, the points are those that are visible. The volume by which the other one has
//! more of them is carried to where it is hidden, at the cost of the squared distance from there: in the plan, to a point
//! beside the others, whose distances from them are not compared.
//!
//! Sources: Cuturi, *Sinkhorn distances: lightspeed computation of optimal transport* (2013); Schmitzer,
//! *Stabilized sparse scaling algorithms for entropy regularized transport problems* (2019), for the falling `eps`;
//! Solomon, Peyré, Kim and Sra, *Entropic metric alignment for correspondence problems* (2016), for the distances;
//! Vayer, Chapel, Flamary, Tavenard and Courty, *Fused Gromov-Wasserstein distance for structured objects* (2020), for
//! the sum of both; Chapel, Alaya and Gasso, *Partial optimal transport with applications on positive-unlabeled
//! learning* (2020), for the point beside the others.

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

/// The volumes of the points of a measure, in cells: one, but for the last one where it stands for all that is
/// hidden.
struct Volumes {
    of: Vec<f64>,
    total: f64,
}

impl Volumes {
    fn new(points: usize, hidden: usize) -> Self {
        let mut of = vec![1.0; points];
        of.extend((hidden > 0).then_some(hidden as f64));
        Self {
            total: (points + hidden) as f64,
            of,
        }
    }

    /// `log sum_j v_j exp(e_j)` for the shares `v_j` of the total volume.
    fn log_mean_exp(&self, exponents: impl Iterator<Item = f64> + Clone) -> f64 {
        let largest = exponents.clone().fold(f64::MIN, f64::max);
        let each = exponents.zip(&self.of);
        let sum: f64 = each.map(|(e, volume)| volume * (e - largest).exp()).sum();
        largest + (sum / self.total).ln()
    }
}

/// The new potential of every column, from that of the rows with their volumes:
/// `-eps log sum_i v_i exp((f_i - c_ij) / eps)`.
fn potential(cost: &DMatrix<f64>, of_rows: &[f64], rows: &Volumes, eps: f64) -> Vec<f64> {
    parallel::map(0..cost.ncols(), &|j| {
        let column = cost.column(j);
        let exponents = of_rows.iter().zip(&column).map(|(f, c)| (f - c) / eps);
        -eps * rows.log_mean_exp(exponents)
    })
}

/// A plan between two clouds.
pub(super) struct Coupling<'a, const D: usize> {
    clouds: [&'a Cloud<D>; 2],
    linear: DMatrix<f64>,
    /// The distances within both shapes.
    within: [DMatrix<f64>; 2],
    /// The means of their squares over what is carried.
    squares: [DVector<f64>; 2],
    /// The volume of each shape that is carried to where the other one is hidden, in points.
    hidden: [usize; 2],
    /// The costs of carrying the points of that shape there.
    to_hidden: DVector<f64>,
    /// The plan between the points of both clouds.
    plan: DMatrix<f64>,
}

impl<'a, const D: usize> Coupling<'a, D> {
    /// Computes the plan between two clouds of nodes of a grid.
    pub fn new(from: &'a Cloud<D>, to: &'a Cloud<D>, grid: &Grid<D>) -> Self {
        let last = LAST_WIDTH * grid.spacing();
        let (n, m) = (from.len(), to.len());
        let within = [from, to].map(Cloud::within);
        let more =
            |of: usize, than: usize, hidden: bool| if hidden { of.saturating_sub(than) } else { 0 };
        let hidden = [
            more(n, m, !to.hidden.is_empty()),
            more(m, n, !from.hidden.is_empty()),
        ];
        let mut coupling = Self {
            clouds: [from, to],
            linear: DMatrix::from_fn(n, m, |i, j| from.apart(i, to, j)),
            squares: within.each_ref().map(|d| d.map(|x| x * x).column_mean()),
            within,
            to_hidden: match hidden {
                [0, 0] => DVector::zeros(0),
                [0, _] => DVector::from_vec(to.apart_from_hidden(from)),
                _ => DVector::from_vec(from.apart_from_hidden(to)),
            },
            hidden,
            plan: DMatrix::zeros(0, 0),
        };
        let volumes = [Volumes::new(n, hidden[1]), Volumes::new(m, hidden[0])];
        let mut width = FIRST_WIDTH.max(last);
        let mut cost = coupling.with_hidden(coupling.linear.clone());
        let mut of_to = vec![0.0; cost.ncols()];
        loop {
            let at_end = width <= last;
            let eps = width * width;
            let turned = cost.transpose();
            let mut of_from = Vec::new();
            for _ in 0..ROUNDS[usize::from(at_end)] {
                of_from = potential(&turned, &of_to, &volumes[1], eps);
                of_to = potential(&cost, &of_from, &volumes[0], eps);
            }
            coupling.plan = plan(&cost, &of_from, &of_to, &volumes, eps);
            coupling.plan.resize_mut(n, m, 0.0);
            coupling.average_squares();
            if at_end {
                return coupling;
            }
            let mut changes = coupling.changes();
            changes *= mutant!(DISTANCES, TransportWithin => 0.0);
            changes += &coupling.linear;
            cost = coupling.with_hidden(changes);
            width = (NARROWER * width).max(last);
        }
    }

    /// Adds the costs of what is carried to where the other shape is hidden.
    fn with_hidden(&self, cost: DMatrix<f64>) -> DMatrix<f64> {
        let (n, m) = cost.shape();
        if self.hidden[0] > 0 {
            let mut cost = cost.resize_horizontally(m + 1, 0.0);
            cost.set_column(m, &self.to_hidden);
            return cost;
        }
        if self.hidden[1] > 0 {
            let mut cost = cost.resize_vertically(n + 1, 0.0);
            cost.set_row(n, &self.to_hidden.transpose());
            return cost;
        }
        cost
    }

    /// Computes the mean squared distances within both shapes from all that is carried by the plan; where all is, they
    /// do not depend on it.
    fn average_squares(&mut self) {
        if self.hidden == [0, 0] {
            return;
        }
        let total = self.plan.sum();
        let carried = [self.plan.column_sum(), self.plan.row_sum().transpose()];
        let both = self.within.iter().zip(carried);
        let squares = both.map(|(within, carried)| within.map(|d| d * d) * carried / total);
        for (own, squares) in self.squares.iter_mut().zip(squares) {
            *own = squares;
        }
    }

    /// The derivative of half of the second term by the plan: the mean squared changes of the distances of two points
    /// from all others.
    fn changes(&self) -> DMatrix<f64> {
        let mut mixed = &self.within[0] * (&self.plan * &self.within[1]);
        if self.hidden != [0, 0] {
            mixed /= self.plan.sum();
        }
        let [from, to] = &self.squares;
        mixed.map_with_location(|i, j, mixed| from[i] + to[j] - 2.0 * mixed)
    }

    /// Returns where the points of both clouds are carried: the means of the plan over the points of the other one; none
    /// for those that are carried to where it is hidden for the most part.
    pub fn targets(&self) -> [Vec<Option<[f64; D]>>; 2] {
        let [from, to] = self.clouds;
        let [more, also] = self.hidden;
        let (turned, volume) = (self.plan.transpose(), (from.len() + also) as f64);
        let volume_to = (to.len() + more) as f64;
        [
            means(&turned, to, volume, more > 0),
            means(&self.plan, from, volume_to, also > 0),
        ]
    }

    /// The mean squared distances of points from their targets, in space and depth, and the mean squared changes of
    /// distances within the shapes.
    pub fn costs(&self) -> [f64; 2] {
        let total = self.plan.sum();
        [&self.linear, &self.changes()].map(|cost| self.plan.dot(cost) / total)
    }
}

/// The plan of some potentials, `v_i w_j exp((f_i + g_j - c_ij) / eps)` for the shares `v_i` and `w_j` of the volumes.
fn plan(
    cost: &DMatrix<f64>,
    of_rows: &[f64],
    of_columns: &[f64],
    volumes: &[Volumes; 2],
    eps: f64,
) -> DMatrix<f64> {
    let (n, m) = cost.shape();
    let [rows, columns] = volumes;
    let both = rows.total * columns.total;
    let shares = parallel::map(0..m, &|j| {
        let column = cost.column(j);
        let each = of_rows.iter().zip(&column).zip(&rows.of);
        let share = |((f, c), volume): ((&f64, &f64), &f64)| {
            volume * columns.of[j] * ((f + of_columns[j] - c) / eps).exp() / both
        };
        each.map(share).collect::<Vec<_>>()
    });
    DMatrix::from_vec(n, m, shares.concat())
}

/// The means of the points of the rows for all columns of a plan, of which each has one of so many parts of the volume.
/// Where some of that is hidden, none for columns of which less than half is visible.
fn means<const D: usize>(
    plan: &DMatrix<f64>,
    rows: &Cloud<D>,
    parts: f64,
    some: bool,
) -> Vec<Option<[f64; D]>> {
    plan.column_iter()
        .map(|shares| {
            let (mut total, mut mean) = (0.0, [0.0; D]);
            for (share, point) in shares.iter().zip(&rows.points) {
                total += share;
                for (mean, x) in mean.iter_mut().zip(point) {
                    *mean += share * x;
                }
            }
            (!some || 2.0 * total * parts >= 1.0).then(|| mean.map(|sum| sum / total))
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
        let (from, to) = (
            Cloud::new(&squares(0.0), None),
            Cloud::new(&squares(0.1875), None),
        );
        assert_eq!(from.len(), to.len());
        for (point, goal) in from
            .points
            .iter()
            .zip(&Coupling::new(&from, &to, &grid).targets()[0])
        {
            let goal = goal.unwrap();
            // The plan is as wide as a cell, so that corners go up to half of one to the inside.
            assert!(
                (goal[0] - point[0] - 0.1875).abs() < 0.5 * grid.spacing(),
                "{point:?} {goal:?}"
            );
            assert!((goal[1] - point[1]).abs() < 0.5 * grid.spacing());
        }
    }

    /// Of two squares the second one is hidden in the other shape: the first one goes to its own.
    #[test]
    fn what_is_hidden_takes_nothing() {
        let grid = Grid::<2>::cube(33);
        let squares = |by: f64| {
            ScalarField::from_fn(grid, |[x, y]| {
                let part = |centre: f64| 0.1 - (x - centre - by).abs().max((y - 0.5).abs());
                [part(0.25).max(part(0.75))]
            })
        };
        let visible = ScalarField::from_fn(grid, |[x, _]| [f64::from(u8::from(x < 0.5))]);
        let whole = Cloud::new(&squares(0.0), None);
        let seen = Cloud::new(&squares(0.0625), Some(&visible));
        assert_eq!(whole.len(), 2 * seen.len());
        let forth = &Coupling::new(&whole, &seen, &grid).targets()[0];
        let back = &Coupling::new(&seen, &whole, &grid).targets()[1];
        for targets in [forth, back] {
            for (point, goal) in whole.points.iter().zip(targets) {
                assert_eq!(goal.is_some(), point[0] < 0.45, "{point:?} {goal:?}");
                // The plan is as wide as a cell.
                let missed = goal.map_or(0.0, |goal| {
                    (goal[0] - point[0] - 0.0625)
                        .abs()
                        .max((goal[1] - point[1]).abs())
                });
                assert!(missed < 0.5 * grid.spacing(), "{point:?} {goal:?}");
            }
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
        let clouds = [[0.34, 0.64], [0.56, 0.86]].map(|arm| Cloud::new(&figure(grid, arm), None));
        let found = Coupling::new(&clouds[0], &clouds[1], &grid).targets();
        let hands = [[0.25, 0.375], [0.25, 0.84375]];
        for (k, goal) in [hands[1], hands[0]].into_iter().enumerate() {
            let at_hand = |point: &[f64; 2]| *point == hands[k];
            let hand = clouds[k].points.iter().position(at_hand).unwrap();
            let found = found[k][hand].unwrap();
            let missed = (0..2).map(|i| (found[i] - goal[i]).abs());
            let missed = missed.fold(0.0, f64::max);
            // Both are the node above the end of the arm; the plan is as wide as a cell.
            assert!(missed < 1.5 * grid.spacing(), "{k} {missed}");
        }
    }
}
