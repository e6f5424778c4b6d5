//! Quality of the modes as a model of a class of shapes, from the Gram matrix alone.
//!
//! The three measures of Davies, Twining and Taylor, *Statistical models of shape* (2008).
//! Correspondences are those of the one average of all shapes, as is usual: a shape that is left
//! out is left out of mean, covariance and modes, but the average is not recomputed without it.

use crate::error::PcaError;
use crate::modes::{Modes, Scores};
use crate::random::Normal;
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
    /// Scores of every shape in the modes of the others.
    pub left_out: Vec<Scores>,
}

impl Quality {
    /// Computes the measures for displacements with this Gram matrix, all of equal weight; centring
    /// does not matter. Distances are those of the inner product of the matrix.
    ///
    /// # Errors
    /// [`PcaError::NoVariation`] if there is no variation without one of the shapes;
    /// [`PcaError::TooFewShapes`].
    ///
    /// # Panics
    /// Unless the matrix is square.
    pub fn new(gram: &DMatrix<f64>, zero: f64, most: usize) -> Result<Self, PcaError> {
        let n = gram.nrows();
        assert!(gram.is_square());
        if n < 2 {
            return Err(PcaError::TooFewShapes { found: n });
        }
        let all: Vec<usize> = (0..n).collect();
        let centred = centred(gram, &all);
        let modes = Modes::new(&centred, &vec![1.0 / n as f64; n], zero, most)?;
        let left_out: Result<Vec<Scores>, PcaError> =
            (0..n).map(|i| leave_out(gram, i, zero, most)).collect();
        let left_out = left_out?;
        let longest = left_out.iter().map(|s| s.errors.len()).max().unwrap_or(0);
        let generalisation = (0..longest)
            .map(|m| {
                let error = |s: &Scores| s.errors[m.min(s.errors.len() - 1)];
                let sum: f64 = left_out.iter().map(|s| error(s).powi(2)).sum();
                (sum / n as f64).sqrt()
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

/// Computes the Gram matrix of all displacements minus the mean of some.
fn centred(gram: &DMatrix<f64>, some: &[usize]) -> DMatrix<f64> {
    let n = gram.nrows();
    let m = some.len() as f64;
    let row: Vec<f64> = (0..n)
        .map(|i| some.iter().map(|&j| gram[(i, j)]).sum::<f64>() / m)
        .collect();
    let mean = some.iter().map(|&i| row[i]).sum::<f64>() / m;
    DMatrix::from_fn(n, n, |i, j| gram[(i, j)] - row[i] - row[j] + mean)
}

/// Computes the scores of a shape in the modes of the others.
fn leave_out(gram: &DMatrix<f64>, i: usize, zero: f64, most: usize) -> Result<Scores, PcaError> {
    let others: Vec<usize> = (0..gram.nrows()).filter(|&j| j != i).collect();
    let n = others.len();
    let centred = centred(gram, &others);
    let own = DMatrix::from_fn(n, n, |a, b| centred[(others[a], others[b])]);
    if n < 2 {
        return Ok(Scores::new(&[], centred[(i, i)], &[], n));
    }
    let modes = Modes::new(&own, &vec![1.0 / n as f64; n], zero, most)?;
    let product = |combination: &Vec<f64>| -> f64 {
        let terms = combination.iter().zip(&others);
        terms.map(|(a, &j)| a * centred[(i, j)]).sum()
    };
    let products: Vec<f64> = modes.combinations.iter().map(product).collect();
    Ok(Scores::new(
        &products,
        centred[(i, i)],
        &modes.eigenvalues,
        n,
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
