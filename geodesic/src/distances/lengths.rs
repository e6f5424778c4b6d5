//! Lengths of the paths from every object to every other, as far as they are known.

use super::matrix::{DistanceError, DistanceMatrix};
use serde::Serialize;

/// Lengths of directed paths between `n` objects. A path that was not computed, or that did not
/// reach its end, has none.
#[derive(Clone, Debug, PartialEq)]
pub struct PathLengths {
    n: usize,
    values: Vec<Option<f64>>,
}

/// How unequal the two directions are: `|L_ij - L_ji|` over the mean of the two, for all pairs of
/// which both are known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Asymmetry {
    /// Pairs.
    pub pairs: usize,
    /// The mean of all.
    pub mean: f64,
    /// The largest of all.
    pub largest: f64,
    /// The pair that has it.
    pub worst: [usize; 2],
}

/// A distance for every pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Completed {
    /// The distances.
    pub matrix: DistanceMatrix,
    /// Pairs `i < j` without a path of their own: their distance is that by way of others.
    pub bridged: Vec<[usize; 2]>,
}

impl PathLengths {
    /// Nothing is known.
    pub fn unknown(n: usize) -> Self {
        Self {
            n,
            values: vec![None; n * n],
        }
    }

    /// Lengths from a function of start and end, which is asked for different objects only.
    pub fn from_fn(n: usize, length: impl Fn(usize, usize) -> Option<f64>) -> Self {
        let mut lengths = Self::unknown(n);
        for i in 0..n {
            for j in (0..n).filter(|&j| j != i) {
                lengths.values[i * n + j] = length(i, j);
            }
        }
        lengths
    }

    /// Number of objects.
    pub fn n_objects(&self) -> usize {
        self.n
    }

    /// The length from one object to another; from an object to itself it is zero.
    ///
    /// # Panics
    /// For objects that do not exist.
    pub fn get(&self, start: usize, end: usize) -> Option<f64> {
        if start == end && start < self.n {
            return Some(0.0);
        }
        self.values[start * self.n + end]
    }

    /// The distance of two objects: the mean of both directions, or the one that is known.
    ///
    /// The error of a discrete length changes its sign with the direction to first order in the
    /// number of steps, so that the mean is correct to second order; see [`super::richardson`].
    pub fn between(&self, i: usize, j: usize) -> Option<f64> {
        match (self.get(i, j), self.get(j, i)) {
            (Some(there), Some(back)) => Some(0.5 * (there + back)),
            (one, other) => one.or(other),
        }
    }

    /// How unequal the two directions are; nothing where no pair has both.
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

    /// A distance for every pair. One without a path of its own gets the shortest way by others,
    /// which in a metric space is no less than its distance: it never makes two objects nearest
    /// neighbours. Nothing where some objects cannot be reached from others at all.
    ///
    /// # Errors
    /// [`DistanceError::Value`] for lengths that are negative or no finite numbers.
    pub fn completed(&self) -> Result<Option<Completed>, DistanceError> {
        let ways = self.shortest_ways();
        let known = |i: usize, j: usize| self.between(i, j);
        if ways.contains(&f64::INFINITY) {
            return Ok(None);
        }
        let matrix =
            DistanceMatrix::from_fn(self.n, |i, j| known(i, j).unwrap_or(ways[i * self.n + j]))?;
        let bridged = matrix
            .pairs()
            .filter(|(i, j, _)| known(*i, *j).is_none())
            .map(|(i, j, _)| [i, j])
            .collect();
        Ok(Some(Completed { matrix, bridged }))
    }

    /// Shortest ways along known distances (Floyd and Warshall); infinite where there are none.
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
