//! Maps of many objects by their distances from a few of them.

use fe_grid::random::SplitMix64;

use super::matrix::DistanceMatrix;
use super::scaling::{Scaling, fix_signs, turn_to_axes};

/// An embedding by the distances from landmarks.
#[derive(Clone, Debug, PartialEq)]
pub struct LandmarkEmbedding<const D: usize> {
    /// A point per landmark, then one for every other object; their centroid is the origin.
    pub points: Vec<[f64; D]>,
    /// All eigenvalues of the scaling of the landmarks, largest first.
    pub eigenvalues: Vec<f64>,
    /// As in [`super::Embedding`], of the landmarks.
    pub explained: f64,
    /// As in [`super::Embedding`], of the landmarks.
    pub negative: f64,
}

/// Computes the embedding of landmarks by classical scaling, and the points of other objects from their
/// distances to the landmarks alone, of which there is one row per object (landmark multidimensional
/// scaling).
///
/// With the first eigenvalues `l_k` and eigenvectors `v_k` of the landmarks, and the means `m` of the
/// columns of their squared distances, an object with the squared distances `s` has the coordinates
/// `-v_k^T (s - m) / (2 sqrt(l_k))`: it is the least-squares projection onto the space of the landmarks.
/// For points of a Euclidean space of `D` dimensions, and landmarks that span it, all distances are exact.
/// Finally the axes are turned to the principal axes of all points, with signs as in
/// [`super::classical_scaling`].
///
/// Source: V. de Silva and J. B. Tenenbaum, *Sparse multidimensional scaling using landmark points*,
/// Stanford University (2004).
///
/// # Panics
/// If a row does not have one distance per landmark.
pub fn landmark_scaling<const D: usize>(
    landmarks: &DistanceMatrix,
    others: &[Vec<f64>],
) -> LandmarkEmbedding<D> {
    let n = landmarks.n_objects();
    let scaling = Scaling::new(landmarks);
    let mut points: Vec<[f64; D]> = (0..n)
        .map(|i| std::array::from_fn(|axis| scaling.coordinate(i, axis)))
        .collect();
    for row in others {
        assert_eq!(row.len(), n, "one distance for each landmark");
        let squares: Vec<f64> = row.iter().map(|d| d * d).collect();
        points.push(std::array::from_fn(|axis| scaling.place(&squares, axis)));
    }
    centre(&mut points);
    turn_to_axes(&mut points);
    fix_signs(&mut points);
    LandmarkEmbedding {
        explained: scaling.explained(D),
        negative: scaling.negative(),
        eigenvalues: scaling.eigenvalues,
        points,
    }
}

fn centre<const D: usize>(points: &mut [[f64; D]]) {
    let n = points.len().max(1) as f64;
    let mean: [f64; D] = std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    for point in points {
        *point = std::array::from_fn(|k| point[k] - mean[k]);
    }
}

/// Returns `count` different numbers below `n`, at random but the same for the same seed, in order; all
/// if there are fewer.
pub fn random_sample(n: usize, count: usize, seed: u64) -> Vec<usize> {
    let mut random = SplitMix64::new(seed);
    let mut all: Vec<usize> = (0..n).collect();
    let count = count.min(n);
    for k in 0..count {
        let other = k + (random.uniform() * (n - k) as f64) as usize;
        all.swap(k, other);
    }
    all.truncate(count);
    all.sort_unstable();
    all
}
