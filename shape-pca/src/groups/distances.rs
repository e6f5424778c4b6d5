//! Tests of distances between shapes.

use super::analysis_of_variance::check_within;
use super::labels::{GroupError, Groups, check_table};
use super::relabelling::Relabelling;
use super::scores::least_p_value;
use serde::Serialize;

/// A permutational analysis of variance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Permanova {
    /// The ratio of the mean squares between and within the groups.
    pub f: f64,
    /// The share of the sum of squares that lies between the groups.
    pub explained: f64,
    /// The probability of such a ratio if the groups do not differ.
    pub p_value: f64,
    /// The least p-value that relabellings of groups of these sizes can have.
    pub least_p_value: f64,
}

/// Tests whether distances between shapes show groups.
///
/// With the squares of the distances `d_ij`, the sum of squares about the centroid of a set of `m`
/// shapes is `1/m sum_{i<j} d_ij^2`; for Euclidean distances this is the analysis of variance. The
/// mean of both triangles of the matrix is used.
///
/// Source: Anderson, *A new method for non-parametric multivariate analysis of variance* (2001).
///
/// # Errors
/// [`GroupError::Count`] and [`GroupError::NotFinite`] for an unsuitable matrix, and [`GroupError::EqualWithin`].
pub fn permanova(
    distances: &[Vec<f64>],
    groups: &Groups,
    relabelling: Relabelling,
) -> Result<Permanova, GroupError> {
    let (n, sizes) = (groups.n_shapes(), groups.sizes());
    check_table(distances, n)?;
    if let Some(row) = distances.first().filter(|row| row.len() != n) {
        return Err(GroupError::Count {
            what: "columns",
            expected: n,
            found: row.len(),
        });
    }
    let mut squares = Vec::new();
    for i in 0..n {
        for j in 0..i {
            let mean = 0.5 * (distances[i][j] + distances[j][i]);
            squares.push((i, j, mean * mean));
        }
    }
    let total = squares.iter().map(|(_, _, d)| d).sum::<f64>() / n as f64;
    let within = |labels: &[usize]| -> f64 {
        let inside = squares.iter().filter(|(i, j, _)| labels[*i] == labels[*j]);
        inside.map(|&(i, _, d)| d / sizes[labels[i]] as f64).sum()
    };
    let between = |labels: &[usize]| vec![total - within(labels)];
    let own = between(groups.labels())[0];
    check_within(own, total)?;
    let p = relabelling.p_values(groups.labels(), &between);
    let inside = (total - own).max(0.0) / (n - sizes.len()) as f64;
    let f = own / (sizes.len() - 1) as f64 / inside;
    Ok(Permanova {
        f: if f.is_nan() { 0.0 } else { f },
        explained: if total > 0.0 { own / total } else { 0.0 },
        p_value: p.single[0],
        least_p_value: least_p_value(sizes, relabelling),
    })
}
