//! Classification of every shape by the others.

use super::labels::{GroupError, Groups};
use super::relabelling::Relabelling;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// How well shapes are classified.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Classification {
    /// Number of modes that were used.
    pub modes: usize,
    /// The group to which every shape was assigned, from the other shapes.
    pub assigned: Vec<usize>,
    /// The number of shapes of the group `i` that were assigned to the group `j`.
    pub confusion: Vec<Vec<usize>>,
    /// The mean over the groups of the share of shapes that were assigned to their own.
    pub balanced_accuracy: f64,
    /// The probability of such an accuracy if the groups do not differ.
    pub p_value: f64,
}

/// Assigns every shape to the group whose mean, of the other shapes, is nearest in the Mahalanobis
/// distance of the covariance within the groups, of the other shapes as well (linear discriminant
/// analysis with equal prior probabilities).
///
/// A covariance of few shapes is uncertain: a tenth of the mean variance is added to its diagonal, and
/// the first `modes` scores are used, or fewer, so that there are at least three times as many shapes.
///
/// The p-value repeats this for relabelled shapes. A shape without another one in its group cannot be
/// assigned to it.
///
/// # Errors
/// [`GroupError::Count`] and [`GroupError::NotFinite`] for an unsuitable table.
pub fn classify(
    scores: &[Vec<f64>],
    groups: &Groups,
    modes: usize,
    relabelling: Relabelling,
) -> Result<Classification, GroupError> {
    groups.check_rows(scores)?;
    let n = groups.n_shapes();
    let available = scores.first().map_or(0, Vec::len);
    let modes = modes.min(available).min((n / 3).max(1));
    let rows: Vec<DVector<f64>> = scores
        .iter()
        .map(|row| DVector::from_row_slice(&row[..modes]))
        .collect();
    let n_groups = groups.sizes().len();
    let assign = |labels: &[usize]| -> Vec<usize> {
        (0..n)
            .map(|left_out| nearest(&rows, labels, n_groups, left_out))
            .collect()
    };
    let accuracy = |labels: &[usize]| {
        let assigned = assign(labels);
        let mut right = vec![0usize; n_groups];
        for (&label, found) in labels.iter().zip(assigned) {
            right[label] += usize::from(label == found);
        }
        let shares = right.iter().zip(groups.sizes());
        let sum: f64 = shares.map(|(&r, &size)| r as f64 / size as f64).sum();
        vec![sum / n_groups as f64]
    };
    let assigned = assign(groups.labels());
    let mut confusion = vec![vec![0; n_groups]; n_groups];
    for (&label, &found) in groups.labels().iter().zip(&assigned) {
        confusion[label][found] += 1;
    }
    Ok(Classification {
        modes,
        assigned,
        confusion,
        balanced_accuracy: accuracy(groups.labels())[0],
        p_value: relabelling.p_values(groups.labels(), &accuracy).single[0],
    })
}

/// The share of the mean variance that is added to every variance.
const SHRINKAGE: f64 = 0.1;

/// The group whose mean is nearest to a shape, without that shape.
fn nearest(rows: &[DVector<f64>], labels: &[usize], n_groups: usize, left_out: usize) -> usize {
    let modes = rows[left_out].len();
    let others = || (0..rows.len()).filter(|&i| i != left_out);
    let mut means = vec![DVector::zeros(modes); n_groups];
    let mut sizes = vec![0.0; n_groups];
    for i in others() {
        means[labels[i]] += &rows[i];
        sizes[labels[i]] += 1.0;
    }
    for (mean, &size) in means.iter_mut().zip(&sizes) {
        if size > 0.0 {
            *mean /= size;
        }
    }
    let mut covariance = DMatrix::<f64>::zeros(modes, modes);
    for i in others() {
        let d = &rows[i] - &means[labels[i]];
        covariance.ger(1.0, &d, &d, 1.0);
    }
    let mean_variance = covariance.trace() / modes.max(1) as f64;
    for j in 0..modes {
        // Groups without any variation are compared in the Euclidean distance.
        covariance[(j, j)] += SHRINKAGE * mean_variance + f64::MIN_POSITIVE;
    }
    let factor = covariance.cholesky();
    let distance = |g: usize| {
        let d = &rows[left_out] - &means[g];
        match &factor {
            Some(factor) if mean_variance > 0.0 => d.dot(&factor.solve(&d)),
            _ => d.norm_squared(),
        }
    };
    let filled = (0..n_groups).filter(|&g| sizes[g] > 0.0);
    // Another shape than the one left out always exists, and has a group.
    filled
        .map(|g| (distance(g), g))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(0, |(_, g)| g)
}
