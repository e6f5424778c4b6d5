//! Lengths of the paths between all pairs of objects, as far as they are known.

use super::matrix::{DistanceError, DistanceMatrix};
use fe_grid::mutant;
use serde::Serialize;

/// Lengths of directed paths between `n` objects. A path that was not computed, or did not reach
/// its end, has no length.
#[derive(Clone, Debug, PartialEq)]
pub struct PathLengths {
    n: usize,
    values: Vec<Option<f64>>,
}

/// Asymmetry of the lengths: `|L_ij - L_ji|` divided by the mean of the two, over all pairs of
/// which both are known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Asymmetry {
    /// Number of pairs.
    pub pairs: usize,
    /// Mean over the pairs.
    pub mean: f64,
    /// Maximum over the pairs.
    pub largest: f64,
    /// The pair of the maximum.
    pub worst: [usize; 2],
}

/// A distance for every pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Completed {
    /// The distances.
    pub matrix: DistanceMatrix,
    /// Pairs `i < j` without a path of their own: their distance is that of the shortest way
    /// through other objects.
    pub filled: Vec<[usize; 2]>,
}

impl PathLengths {
    /// Creates lengths of which none is known.
    pub fn unknown(n: usize) -> Self {
        Self {
            n,
            values: vec![None; n * n],
        }
    }

    /// Computes lengths by a function of start and end, which is called for different objects only.
    pub fn from_fn(n: usize, length: impl Fn(usize, usize) -> Option<f64>) -> Self {
        let mut lengths = Self::unknown(n);
        for i in 0..n {
            for j in (0..n).filter(|&j| j != i) {
                lengths.values[i * n + j] = length(i, j);
            }
        }
        lengths
    }

    /// Returns the number of objects.
    pub fn n_objects(&self) -> usize {
        self.n
    }

    /// Returns the length from one object to another; from an object to itself it is zero.
    ///
    /// # Panics
    /// For objects that do not exist.
    pub fn get(&self, start: usize, end: usize) -> Option<f64> {
        if start == end && start < self.n {
            return Some(0.0);
        }
        self.values[start * self.n + end]
    }

    /// Returns the distance between two objects: the mean of both directions, or the one that is
    /// known.
    ///
    /// The error of a discrete length changes its sign with the direction to first order in the
    /// number of steps, so that the mean is correct to second order; see [`super::richardson`].
    pub fn between(&self, i: usize, j: usize) -> Option<f64> {
        match (self.get(i, j), self.get(j, i)) {
            (Some(there), Some(back)) => Some(mutant!(
                0.5 * (there + back),
                DirectionsNotMeant => there
            )),
            (one, other) => one.or(other),
        }
    }

    /// Returns the asymmetry; `None` if no pair has both lengths.
    pub fn asymmetry(&self) -> Option<Asymmetry> {
        let (mut sum, mut pairs) = (0.0, 0);
        let (mut largest, mut worst) = (-1.0, [0, 0]);
        for i in 0..self.n {
            for j in i + 1..self.n {
                let (Some(there), Some(back)) = (self.get(i, j), self.get(j, i)) else {
                    continue;
                };
                let mean = 0.5 * (there + back);
                let share = if mean > 0.0 {
                    (there - back).abs() / mean
                } else {
                    0.0
                };
                sum += share;
                pairs += 1;
                if share > largest {
                    (largest, worst) = (share, [i, j]);
                }
            }
        }
        (pairs > 0).then(|| Asymmetry {
            pairs,
            mean: sum / pairs as f64,
            largest,
            worst,
        })
    }

    /// Computes a distance for every pair. A pair without a path of its own gets the length of the
    /// shortest way through others, which by the triangle inequality is an upper bound of the
    /// distance: it never makes two objects nearest neighbours. `None` if some objects are not
    /// connected at all.
    ///
    /// # Errors
    /// [`DistanceError::Value`] for lengths that are negative or not finite.
    pub fn completed(&self) -> Result<Option<Completed>, DistanceError> {
        let ways = self.shortest_ways();
        let known = |i: usize, j: usize| self.between(i, j);
        if ways.contains(&f64::INFINITY) {
            return Ok(None);
        }
        let matrix =
            DistanceMatrix::from_fn(self.n, |i, j| known(i, j).unwrap_or(ways[i * self.n + j]))?;
        let filled = matrix
            .pairs()
            .filter(|(i, j, _)| known(*i, *j).is_none())
            .map(|(i, j, _)| [i, j])
            .collect();
        Ok(Some(Completed { matrix, filled }))
    }

    /// Computes shortest ways along known distances (Floyd and Warshall); infinite if there are
    /// none.
    fn shortest_ways(&self) -> Vec<f64> {
        let n = self.n;
        let mut ways = vec![f64::INFINITY; n * n];
        for i in 0..n {
            for j in 0..n {
                if let Some(distance) = self.between(i, j) {
                    ways[i * n + j] = distance;
                }
            }
        }
        for k in 0..n {
            for i in 0..n {
                for j in 0..n {
                    let by = ways[i * n + k] + ways[k * n + j];
                    if by < ways[i * n + j] {
                        ways[i * n + j] = by;
                    }
                }
            }
        }
        ways
    }
}
