//! Distances between all pairs of objects.

/// Two halves of a matrix that differ by more than this share are not equal.
const SYMMETRY: f64 = 1e-9;

/// What keeps numbers from being distances.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DistanceError {
    /// Another number of values than objects have pairs.
    #[error("{n} objects need a matrix of {expected} numbers, found {found}")]
    Count {
        /// Objects.
        n: usize,
        /// Their square.
        expected: usize,
        /// Numbers given.
        found: usize,
    },
    /// A distance that is negative or no finite number.
    #[error("the distance of {i} and {j} is {value}")]
    Value {
        /// One object.
        i: usize,
        /// The other.
        j: usize,
        /// The number given.
        value: f64,
    },
    /// An object that is away from itself.
    #[error("the distance of {i} from itself is {value}")]
    Diagonal {
        /// The object.
        i: usize,
        /// The number given.
        value: f64,
    },
    /// A distance that depends on the direction.
    #[error("the distance from {i} to {j} is {there}, but {back} in the other direction")]
    Asymmetric {
        /// One object.
        i: usize,
        /// The other.
        j: usize,
        /// The number in the one direction.
        there: f64,
        /// The number in the other.
        back: f64,
    },
}

/// Distances between `n` objects: finite, not negative, symmetric, zero on the diagonal. The
/// triangle inequality is not asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceMatrix {
    n: usize,
    /// All rows.
    values: Vec<f64>,
}

impl DistanceMatrix {
    /// A matrix from its rows, one after the other. Entries that differ from their mirror image
    /// by rounding are replaced by the mean of both.
    ///
    /// # Errors
    /// [`DistanceError`] for numbers that are no distances.
    pub fn new(n: usize, rows: &[f64]) -> Result<Self, DistanceError> {
        if rows.len() != n * n {
            return Err(DistanceError::Count {
                n,
                expected: n * n,
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

    /// A matrix from a function of two objects, which is asked for `i < j` only.
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

    /// Number of objects.
    pub fn n_objects(&self) -> usize {
        self.n
    }

    /// The distance of two objects.
    ///
    /// # Panics
    /// For objects that do not exist.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        self.row(i)[j]
    }

    /// The distances from one object.
    ///
    /// # Panics
    /// For an object that does not exist.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.n..(i + 1) * self.n]
    }

    /// All pairs `i < j` with their distance.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.n).flat_map(move |i| (i + 1..self.n).map(move |j| (i, j, self.get(i, j))))
    }
}
