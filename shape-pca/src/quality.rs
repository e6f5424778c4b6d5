//! Quality of the modes as a model of a class of shapes, from the Gram matrix alone.
//!
//! The three measures of Davies, Twining and Taylor, *Statistical models of shape* (2008).
//! Correspondences are those of the one average of all shapes, as is usual: a shape that is left
//! out is left out of mean, covariance and modes, but the average is not recomputed without it.

use crate::error::PcaError;
use crate::modes::{Modes, Scores};
use crate::random::Normal;
use crate::sample::SampleSize;
use nalgebra::DMatrix;
use serde::Serialize;

/// Number of random shapes for the specificity.
const SAMPLES: usize = 2000;

/// Compactness, generalisation and specificity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Fraction of the variance in the first `m` modes, `m = 1, 2, ...`.
    pub compactness: Vec<f64>,
    /// Root mean square over all shapes of the distance between a shape and its projection onto `m`
    /// modes of the others, `m = 0, 1, ...`.
    pub generalisation: Vec<f64>,
    /// Root mean square of the distance between a random shape of `m` modes and the nearest
    /// training shape, `m = 1, 2, ...`.
    pub specificity: Vec<f64>,
    /// Scores of every shape in the modes of the others; none where these are equal.
    pub left_out: Vec<Scores>,
}

impl Quality {
    /// Computes the measures for displacements with this Gram matrix and these weights; centring
    /// does not matter. Distances are those of the inner product of the matrix, and means those of the weights: shapes
    /// of weight zero have scores, but influence nothing else.
    ///
    /// # Errors
    /// [`PcaError::NoVariation`] if all shapes are equal; [`PcaError::TooFewShapes`].
    ///
    /// # Panics
    /// Unless the matrix has a row and a column for each weight.
    pub fn new(
        gram: &DMatrix<f64>,
        weights: &[f64],
        zero: f64,
        most: usize,
    ) -> Result<Self, PcaError> {
        let n = weights.len();
        assert_eq!(
            gram.shape(),
            (n, n),
            "a row, a column and a weight for each shape"
        );
        let counted: Vec<usize> = (0..n).filter(|&i| weights[i] > 0.0).collect();
        let (gram_of_counted, shares) = (part(gram, &counted), shares(weights, &counted));
        let all: Vec<usize> = (0..counted.len()).collect();
        let centred = centred(&gram_of_counted, &all, &shares);
        let modes = Modes::new(&centred, &shares, zero, most)?;
        let left_out: Result<Vec<Scores>, PcaError> = (0..n)
            .map(|i| leave_out(gram, weights, i, zero, most))
            .collect();
        let left_out = left_out?;
        let longest = left_out.iter().map(|s| s.errors.len()).max().unwrap_or(0);
        let generalisation = (0..longest)
            .map(|m| {
                let error = |s: &Scores| s.errors[m.min(s.errors.len() - 1)];
                let squares = counted.iter().zip(&shares);
                let squares = squares.map(|(&i, share)| share * error(&left_out[i]).powi(2));
                squares.sum::<f64>().sqrt()
            })
            .collect();
        Ok(Self {
            compactness: modes.compactness(),
            generalisation,
            specificity: specificity(&centred, &modes),
            left_out,
        })
    }
}

/// The weights of some shapes relative to their sum.
fn shares(weights: &[f64], some: &[usize]) -> Vec<f64> {
    let sum: f64 = some.iter().map(|&i| weights[i]).sum();
    some.iter().map(|&i| weights[i] / sum).collect()
}

/// The rows and columns of some shapes.
fn part(matrix: &DMatrix<f64>, some: &[usize]) -> DMatrix<f64> {
    let n = some.len();
    DMatrix::from_fn(n, n, |a, b| matrix[(some[a], some[b])])
}

/// Computes the Gram matrix of all displacements minus the mean of some, with their shares in it.
fn centred(gram: &DMatrix<f64>, some: &[usize], shares: &[f64]) -> DMatrix<f64> {
    let n = gram.nrows();
    let mean = |of: &dyn Fn(usize) -> f64| -> f64 {
        some.iter()
            .zip(shares)
            .map(|(&j, share)| share * of(j))
            .sum()
    };
    let row: Vec<f64> = (0..n).map(|i| mean(&|j| gram[(i, j)])).collect();
    let all = mean(&|i| row[i]);
    DMatrix::from_fn(n, n, |i, j| gram[(i, j)] - row[i] - row[j] + all)
}

/// Computes the scores of a shape in the modes of the others.
fn leave_out(
    gram: &DMatrix<f64>,
    weights: &[f64],
    i: usize,
    zero: f64,
    most: usize,
) -> Result<Scores, PcaError> {
    let others: Vec<usize> = (0..weights.len())
        .filter(|&j| j != i && weights[j] > 0.0)
        .collect();
    let (sample, shares) = (SampleSize::without(weights, i), shares(weights, &others));
    let centred = centred(gram, &others, &shares);
    let found = Modes::new(&part(&centred, &others), &shares, zero, most);
    let modes = match found {
        // One shape, or equal ones.
        Err(PcaError::TooFewShapes { .. } | PcaError::NoVariation) => {
            return Ok(Scores::new(&[], centred[(i, i)], &[], sample));
        }
        found => found?,
    };
    let product = |combination: &Vec<f64>| -> f64 {
        let terms = combination.iter().zip(&others);
        terms.map(|(a, &j)| a * centred[(i, j)]).sum()
    };
    let products: Vec<f64> = modes.combinations.iter().map(product).collect();
    Ok(Scores::new(
        &products,
        centred[(i, i)],
        &modes.eigenvalues,
        sample,
    ))
}

fn specificity(gram: &DMatrix<f64>, modes: &Modes) -> Vec<f64> {
    let (n, rank) = (gram.nrows(), modes.rank());
    // Coordinates of the training shapes in the modes, in whose span they lie.
    let coordinate = |i: usize, j: usize| -> f64 {
        let terms = modes.combinations[j].iter().enumerate();
        terms.map(|(k, a)| a * gram[(i, k)]).sum()
    };
    let training: Vec<Vec<f64>> = (0..n)
        .map(|i| (0..rank).map(|j| coordinate(i, j)).collect())
        .collect();
    let mut normal = Normal::new(20);
    let samples: Vec<Vec<f64>> = (0..SAMPLES)
        .map(|_| {
            let deviations = modes.eigenvalues[..rank].iter();
            deviations.map(|l| l.sqrt() * normal.next()).collect()
        })
        .collect();
    (1..=rank)
        .map(|m| {
            let nearest = |sample: &Vec<f64>| {
                let square = |shape: &Vec<f64>| -> f64 {
                    let own = (0..m).map(|j| (sample[j] - shape[j]).powi(2)).sum::<f64>();
                    own + shape[m..].iter().map(|x| x * x).sum::<f64>()
                };
                training.iter().map(square).fold(f64::INFINITY, f64::min)
            };
            (samples.iter().map(nearest).sum::<f64>() / SAMPLES as f64).sqrt()
        })
        .collect()
}
