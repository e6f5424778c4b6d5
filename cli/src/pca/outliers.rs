//! Shapes that lie unusually far from the others.

use serde::Serialize;
use shape_pca::Quality;

/// The largest probability, of any of all shapes, at which one is named.
const LEVEL: f64 = 0.05;

/// A shape that lies far from the others, in the modes of these.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Outlier<'a> {
    /// Its name.
    pub shape: &'a str,
    /// The probability of at least its distance.
    pub p_value: f64,
    /// The same times the number of shapes, at most 1: a bound of the probability that any of them is so far away
    /// (Bonferroni).
    pub p_value_of_all: f64,
}

impl Outlier<'_> {
    /// Its name and its p-value.
    pub fn in_words(&self) -> String {
        format!("{} (p = {:.2e})", self.shape, self.p_value_of_all)
    }
}

/// The outliers, by the distances of shapes in the modes of the others: in the modes that it is a part of, a shape
/// cannot be far away.
pub(super) fn outliers<'a>(names: &'a [String], quality: &Quality) -> Vec<Outlier<'a>> {
    let n = quality.left_out.len() as f64;
    let all = names.iter().zip(&quality.left_out);
    let all = all.map(|(shape, scores)| {
        let p_value = scores.mahalanobis.p_value;
        Outlier {
            shape,
            p_value,
            p_value_of_all: f64::min(1.0, n * p_value),
        }
    });
    all.filter(|outlier| outlier.p_value_of_all < LEVEL)
        .collect()
}
