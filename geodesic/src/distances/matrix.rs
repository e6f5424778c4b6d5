//! Distances between all pairs of objects.

/// Relative difference above which two entries are not considered equal.
const SYMMETRY: f64 = 1e-9;

/// Errors of distance matrices.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DistanceError {
    /// The number of values is not the square of the number of objects.
    #[error("{n} objects need a matrix of {expected} numbers, found {found}")]
    Count {
        /// Number of objects.
        n: usize,
        /// Its square.
        expected: usize,
        /// Number of given values.
        found: usize,
    },
    /// A distance is negative or not finite.
    #[error("the distance between {i} and {j} is {value}")]
    Value {
        /// One object.
        i: usize,
        /// The other.
        j: usize,
        /// The given value.
        value: f64,
    },
    /// The distance of an object from itself is not zero.
    #[error("the distance of {i} from itself is {value}")]
    Diagonal {
        /// The object.
        i: usize,
        /// The given value.
        value: f64,
    },
    /// A distance depends on the direction.
    #[error("the distance from {i} to {j} is {there}, but {back} from {j} to {i}")]
    Asymmetric {
        /// One object.
        i: usize,
        /// The other.
        j: usize,
        /// The value in one direction.
        there: f64,
        /// The value in the other.
        back: f64,
    },
}

/// Distances between `n` objects: finite, nonnegative, symmetric, zero on the diagonal. The
/// triangle inequality is not required.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceMatrix {
    n: usize,
    /// All rows, one after the other.
    values: Vec<f64>,
}

impl DistanceMatrix {
    /// Creates a matrix from its rows, one after the other. Entries that differ from their
    /// transposed ones by rounding are replaced by the mean of both.
    ///
    /// # Errors
    /// [`DistanceError`] for values that are not distances.
    pub fn new(n: usize, rows: &[f64]) -> Result<Self, DistanceError> {
        let expected = n.saturating_mul(n);
        if rows.len() != expected {
            return Err(DistanceError::Count {
                n,
                expected,
                found: rows.len(),
            });
        }
        for i in 0..n {
            let value = rows[i * n + i];
            if value != 0.0 {
                return Err(DistanceError::Diagonal { i, value });
            }
        }
        Self::from_fn(n, |i, j| 0.5 * (rows[i * n + j] + rows[j * n + i])).and_then(|matrix| {
            for i in 0..n {
                for j in 0..i {
                    let (there, back) = (rows[i * n + j], rows[j * n + i]);
                    if (there - back).abs() > SYMMETRY * there.abs().max(back.abs()) {
                        return Err(DistanceError::Asymmetric { i, j, there, back });
                    }
                }
            }
            Ok(matrix)
        })
    }

    /// Creates a matrix from a function of two objects, which is called for `i < j` only.
    ///
    /// # Errors
    /// [`DistanceError::Value`].
    pub fn from_fn(
        n: usize,
        mut distance: impl FnMut(usize, usize) -> f64,
    ) -> Result<Self, DistanceError> {
        let mut values = vec![0.0; n * n];
        for i in 0..n {
            for j in i + 1..n {
                let value = distance(i, j);
                if !(value >= 0.0 && value.is_finite()) {
                    return Err(DistanceError::Value { i, j, value });
                }
                values[i * n + j] = value;
                values[j * n + i] = value;
            }
        }
        Ok(Self { n, values })
    }

    /// Returns the number of objects.
    pub fn n_objects(&self) -> usize {
        self.n
    }

    /// Returns the distance between two objects.
    ///
    /// # Panics
    /// For objects that do not exist.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        self.row(i)[j]
    }

    /// Returns the distances from one object.
    ///
    /// # Panics
    /// For an object that does not exist.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.n..(i + 1) * self.n]
    }

    /// Returns an iterator over all pairs `i < j` with their distance.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.n).flat_map(move |i| (i + 1..self.n).map(move |j| (i, j, self.get(i, j))))
    }
}
