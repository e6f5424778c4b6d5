//! Multidimensional scaling: points in few dimensions whose distances approximate given ones.

use nalgebra::{DMatrix, SymmetricEigen};

use super::matrix::DistanceMatrix;

/// Maximal number of steps of the refinement.
const MOST_STEPS: usize = 2000;
/// Relative tolerance: the refinement ends when a step decreases the stress by less than this
/// fraction.
const TOLERANCE: f64 = 1e-9;
/// Relative difference up to which sizes of coordinates count as equal.
const EQUAL: f64 = 1e-6;

/// An embedding by classical scaling.
#[derive(Clone, Debug, PartialEq)]
pub struct Embedding<const D: usize> {
    /// A point per object, with the centroid in the origin.
    pub points: Vec<[f64; D]>,
    /// All eigenvalues, largest first.
    pub eigenvalues: Vec<f64>,
    /// The positive ones among the first `D` eigenvalues, divided by the sum of the absolute values
    /// of all: the fraction of the variance explained by the embedding.
    pub explained: f64,
    /// The absolute values of the negative eigenvalues, divided by the sum of the absolute values
    /// of all: the fraction that no Euclidean space can represent.
    pub negative: f64,
}

/// An embedding refined by stress majorisation.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined<const D: usize> {
    /// A point per object, with the centroid in the origin.
    pub points: Vec<[f64; D]>,
    /// Its [`stress`].
    pub stress: f64,
    /// Number of steps.
    pub steps: usize,
}

/// Computes the embedding by classical multidimensional scaling (Torgerson 1952): with
/// `J = 1 - 11^T / n`, the first
/// eigenvectors of `-J d^2 J / 2`, each times the square root of its eigenvalue. Points of a
/// Euclidean
/// space of `D` dimensions are recovered up to a rigid motion.
///
/// The axes are those of the variance, largest first; the signs are such that the largest
/// coordinate on each axis is positive (the first of equally large ones).
pub fn classical_scaling<const D: usize>(matrix: &DistanceMatrix) -> Embedding<D> {
    let scaling = Scaling::new(matrix);
    let mut points: Vec<[f64; D]> = (0..matrix.n_objects())
        .map(|i| std::array::from_fn(|axis| scaling.coordinate(i, axis)))
        .collect();
    fix_signs(&mut points);
    Embedding {
        explained: scaling.explained(D),
        negative: scaling.negative(),
        points,
        eigenvalues: scaling.eigenvalues,
    }
}

/// The eigenvectors of classical scaling.
pub(super) struct Scaling {
    /// Largest first.
    pub eigenvalues: Vec<f64>,
    /// The columns of the eigenvectors, in this order.
    ranks: Vec<usize>,
    vectors: DMatrix<f64>,
    /// The mean of the squared distances of every object.
    means: Vec<f64>,
}

impl Scaling {
    pub fn new(matrix: &DistanceMatrix) -> Self {
        let n = matrix.n_objects();
        let squares = DMatrix::from_fn(n, n, |i, j| matrix.get(i, j).powi(2));
        let means: Vec<f64> = (0..n).map(|i| squares.row(i).sum() / n as f64).collect();
        let mean = means.iter().sum::<f64>() / n.max(1) as f64;
        let centred = DMatrix::from_fn(n, n, |i, j| {
            -0.5 * (squares[(i, j)] - means[i] - means[j] + mean)
        });
        if n == 0 {
            return Self {
                eigenvalues: Vec::new(),
                ranks: Vec::new(),
                vectors: centred,
                means,
            };
        }
        let found = SymmetricEigen::new(centred);
        let mut ranks: Vec<usize> = (0..n).collect();
        ranks.sort_by(|&a, &b| found.eigenvalues[b].total_cmp(&found.eigenvalues[a]));
        Self {
            eigenvalues: ranks.iter().map(|&k| found.eigenvalues[k]).collect(),
            ranks,
            vectors: found.eigenvectors,
            means,
        }
    }

    /// A coordinate of one of the objects; zero on axes without a positive eigenvalue.
    pub fn coordinate(&self, object: usize, axis: usize) -> f64 {
        let root = self
            .eigenvalues
            .get(axis)
            .map_or(0.0, |l| l.max(0.0).sqrt());
        let vector = self.ranks.get(axis);
        vector.map_or(0.0, |&k| root * self.vectors[(object, k)])
    }

    /// A coordinate of another object by its squared distances from all of them.
    pub fn place(&self, squares: &[f64], axis: usize) -> f64 {
        let largest = self.eigenvalues.first().copied().unwrap_or(0.0);
        let value = self.eigenvalues.get(axis).copied().unwrap_or(0.0);
        // The others are zero up to rounding.
        if value <= EQUAL * EQUAL * largest {
            return 0.0;
        }
        let vector = self.vectors.column(self.ranks[axis]);
        let terms = vector.iter().zip(squares).zip(&self.means);
        let sum: f64 = terms.map(|((v, square), mean)| v * (square - mean)).sum();
        -0.5 * sum / value.sqrt()
    }

    /// The share of the first positive eigenvalues in the absolute values of all.
    pub fn explained(&self, axes: usize) -> f64 {
        self.share(self.eigenvalues.iter().take(axes).map(|l| l.max(0.0)).sum())
    }

    /// The share of the negative eigenvalues.
    pub fn negative(&self) -> f64 {
        self.share(self.eigenvalues.iter().map(|l| (-l).max(0.0)).sum())
    }

    fn share(&self, part: f64) -> f64 {
        let all: f64 = self.eigenvalues.iter().map(|l| l.abs()).sum();
        if all > 0.0 { part / all } else { 0.0 }
    }
}

/// Minimises the stress of points by majorisation (SMACOF; de Leeuw 1977): each step is the Guttman
/// transform `x_i <- 1/n sum_j (x_i - x_j) d_ij / |x_i - x_j|`, which never increases the stress.
/// Points on a line remain on it. Finally the axes are rotated to the principal axes, with signs as
/// in [`classical_scaling`], whose result is a good start.
///
/// # Panics
/// If there is not one point per object.
pub fn smacof<const D: usize>(matrix: &DistanceMatrix, start: &[[f64; D]]) -> Refined<D> {
    assert_eq!(start.len(), matrix.n_objects(), "one point for each object");
    let mut points = start.to_vec();
    let mut now = stress(matrix, &points);
    let mut steps = 0;
    while steps < MOST_STEPS && now > 0.0 {
        let next = guttman(matrix, &points);
        let reached = stress(matrix, &next);
        // Rounding may increase the stress at the very end.
        if reached >= now {
            break;
        }
        let gained = now - reached;
        (points, now) = (next, reached);
        steps += 1;
        if gained < TOLERANCE * now {
            break;
        }
    }
    turn_to_axes(&mut points);
    fix_signs(&mut points);
    Refined {
        points,
        stress: now,
        steps,
    }
}

/// Computes the stress of points (Kruskal's stress-1): the square root of
/// `sum (|x_i - x_j| - d_ij)^2 / sum d_ij^2` over all pairs; zero if all distances are zero.
///
/// # Panics
/// If there are fewer points than objects.
pub fn stress<const D: usize>(matrix: &DistanceMatrix, points: &[[f64; D]]) -> f64 {
    stress_of_pairs(matrix.pairs(), points)
}

/// Computes the [`stress`] over some pairs, given with their distances.
///
/// # Panics
/// If there is no point of an object of a pair.
pub fn stress_of_pairs<const D: usize>(
    pairs: impl IntoIterator<Item = (usize, usize, f64)>,
    points: &[[f64; D]],
) -> f64 {
    let (mut misfit, mut all) = (0.0, 0.0);
    for (i, j, distance) in pairs {
        misfit += (distance_between(&points[i], &points[j]) - distance).powi(2);
        all += distance * distance;
    }
    if all > 0.0 {
        f64::sqrt(misfit / all)
    } else {
        0.0
    }
}

fn guttman<const D: usize>(matrix: &DistanceMatrix, points: &[[f64; D]]) -> Vec<[f64; D]> {
    let n = points.len();
    let moved = |i: usize| {
        let mut sum = [0.0; D];
        for j in (0..n).filter(|&j| j != i) {
            let length = distance_between(&points[i], &points[j]);
            if length > 0.0 {
                let factor = matrix.get(i, j) / length;
                sum = std::array::from_fn(|k| sum[k] + factor * (points[i][k] - points[j][k]));
            }
        }
        sum.map(|x| x / n as f64)
    };
    (0..n).map(moved).collect()
}

/// Rotates points, whose centroid is the origin, to their principal axes.
pub(super) fn turn_to_axes<const D: usize>(points: &mut [[f64; D]]) {
    let spread = DMatrix::from_fn(D, D, |a, b| points.iter().map(|p| p[a] * p[b]).sum::<f64>());
    let found = SymmetricEigen::new(spread);
    let mut ranks: Vec<usize> = (0..D).collect();
    ranks.sort_by(|&a, &b| found.eigenvalues[b].total_cmp(&found.eigenvalues[a]));
    for point in points {
        let old = *point;
        *point = std::array::from_fn(|axis| {
            let vector = found.eigenvectors.column(ranks[axis]);
            old.iter().zip(vector.iter()).map(|(x, v)| x * v).sum()
        });
    }
}

pub(super) fn fix_signs<const D: usize>(points: &mut [[f64; D]]) {
    for axis in 0..D {
        let largest = points.iter().map(|p| p[axis].abs()).fold(0.0, f64::max);
        let leading = points
            .iter()
            .map(|p| p[axis])
            .find(|x| x.abs() >= (1.0 - EQUAL) * largest);
        if leading.is_some_and(|x| x < 0.0) {
            for point in points.iter_mut() {
                point[axis] = -point[axis];
            }
        }
    }
}

fn distance_between<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let squares = a.iter().zip(b).map(|(x, y)| (x - y).powi(2));
    squares.sum::<f64>().sqrt()
}
