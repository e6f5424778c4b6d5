//! The optimal transport between two clouds of points, regularised by its entropy.
//!
//! For points `x_i` and `y_j` of equal weights, `sum_ij p_ij c_ij + eps sum_ij p_ij log p_ij` is minimised over all
//! plans `p` with these marginals, with
//!
//! ```text
//! c_ij = |x_i - y_j|^2 + (d(x_i) - d(y_j))^2,
//! ```
//!
//! where `d` is the depth of a point below the boundary of its shape: points of the boundary go to the boundary. The
//! dual potentials are found by alternating their equations, in logarithms, while `eps` falls from the square of the
//! size of the box to that of a cell.
//!
//! Sources: Cuturi, *Sinkhorn distances: lightspeed computation of optimal transport* (2013); Schmitzer,
//! *Stabilized sparse scaling algorithms for entropy regularized transport problems* (2019), for the falling `eps`.

use fe_grid::{Grid, ScalarField, parallel};

/// The square root of the first `eps`, in sides of the box.
const FIRST_WIDTH: f64 = 0.25;
/// Its factor from round to round.
const NARROWER: f64 = 0.8;
/// The last one, in cells.
const LAST_WIDTH: f64 = 0.7;
/// Iterations for every `eps`, and for the last one.
const ROUNDS: [usize; 2] = [3, 10];

/// The nodes inside of a shape, as a uniform measure.
pub(super) struct Cloud<const D: usize> {
    pub nodes: Vec<usize>,
    points: Vec<[f64; D]>,
    depths: Vec<f64>,
}

impl<const D: usize> Cloud<D> {
    /// Takes the nodes where a signed distance is positive.
    pub fn new(distance: &ScalarField<f64, D>) -> Self {
        let grid = distance.grid();
        let depth = |node: &usize| distance.as_slice()[*node];
        let nodes: Vec<usize> = (0..grid.n_nodes()).filter(|n| depth(n) > 0.0).collect();
        Self {
            points: nodes.iter().map(|&n| grid.position(grid.node(n))).collect(),
            depths: nodes.iter().map(depth).collect(),
            nodes,
        }
    }

    fn len(&self) -> usize {
        self.nodes.len()
    }

    fn cost(&self, i: usize, other: &Self, j: usize) -> f64 {
        let (x, y) = (&self.points[i], &other.points[j]);
        let apart: f64 = x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum();
        apart + (self.depths[i] - other.depths[j]).powi(2)
    }

    /// The new potential at every point, from that of the other cloud: `-eps log mean_j exp((g_j - c_ij) / eps)`.
    fn potential(&self, other: &Self, of_other: &[f64], eps: f64) -> Vec<f64> {
        parallel::map(0..self.len(), &|i| {
            let exponent = |j: usize| (of_other[j] - self.cost(i, other, j)) / eps;
            let largest = (0..other.len()).map(exponent).fold(f64::MIN, f64::max);
            let sum: f64 = (0..other.len())
                .map(|j| (exponent(j) - largest).exp())
                .sum();
            -eps * (largest + (sum / other.len() as f64).ln())
        })
    }
}

/// Returns where the points of the first cloud are carried: the mean of the plan over the points of the second one.
pub(super) fn targets<const D: usize>(
    from: &Cloud<D>,
    to: &Cloud<D>,
    grid: &Grid<D>,
) -> Vec<[f64; D]> {
    let last = LAST_WIDTH * grid.spacing();
    let mut width = FIRST_WIDTH.max(last);
    let mut of_to = vec![0.0; to.len()];
    loop {
        let at_end = width <= last;
        for _ in 0..ROUNDS[usize::from(at_end)] {
            let of_from = from.potential(to, &of_to, width * width);
            of_to = to.potential(from, &of_from, width * width);
        }
        if at_end {
            break;
        }
        width = (NARROWER * width).max(last);
    }
    let eps = width * width;
    parallel::map(0..from.len(), &|i| {
        let exponent = |j: usize| (of_to[j] - from.cost(i, to, j)) / eps;
        let largest = (0..to.len()).map(exponent).fold(f64::MIN, f64::max);
        let (mut total, mut mean) = (0.0, [0.0; D]);
        for (j, point) in to.points.iter().enumerate() {
            let share = (exponent(j) - largest).exp();
            total += share;
            for (mean, x) in mean.iter_mut().zip(point) {
                *mean += share * x;
            }
        }
        mean.map(|sum| sum / total)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
        for (point, goal) in from.points.iter().zip(targets(&from, &to, &grid)) {
            // The plan is as wide as a cell, so that corners go up to half of one to the inside.
            assert!(
                (goal[0] - point[0] - 0.1875).abs() < 0.5 * grid.spacing(),
                "{point:?} {goal:?}"
            );
            assert!((goal[1] - point[1]).abs() < 0.5 * grid.spacing());
        }
    }
}
