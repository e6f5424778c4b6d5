//! Regression of shapes on a covariate.

use super::labels::{GroupError, check_table};
use super::relabelling::Relabelling;
use serde::Serialize;

/// Coordinates as linear functions of a covariate, `intercept_j + slope_j x`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Regression {
    /// The coordinate in every mode at zero.
    pub intercept: Vec<f64>,
    /// The change of the coordinate in every mode per unit of the covariate.
    pub slope: Vec<f64>,
    /// The coefficient of determination of every mode.
    pub r_squared: Vec<f64>,
    /// The p-value of every mode, regarded by itself.
    pub p_value: Vec<f64>,
    /// The p-value of every mode with control of the family-wise error.
    pub p_value_family_wise: Vec<f64>,
    /// The share of the variance of all modes that the covariate explains.
    pub r_squared_overall: f64,
    /// Its p-value.
    pub p_value_overall: f64,
}

impl Regression {
    /// The coordinates at a value of the covariate.
    pub fn predict(&self, x: f64) -> Vec<f64> {
        let pairs = self.intercept.iter().zip(&self.slope);
        pairs.map(|(a, b)| a + b * x).collect()
    }
}

/// Whether finite numbers are equal but for rounding, or so near to zero that their squares vanish: then nothing is
/// regressed on them.
pub fn is_constant(covariate: &[f64]) -> bool {
    let n = covariate.len().max(1) as f64;
    let mean = covariate.iter().sum::<f64>() / n;
    let square: f64 = covariate.iter().map(|x| (x - mean).powi(2)).sum();
    let scale = covariate.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    // Equal numbers differ from their mean by rounding.
    square.sqrt() <= 1e-12 * scale * n.sqrt()
}

/// Fits the coordinates of shapes in their modes, a row for every shape, to a covariate by least squares, and
/// tests them by permutations of the covariate. As for [`compare_scores`](super::compare_scores), a mode
/// counts by its variance in the test of all modes.
///
/// # Errors
/// [`GroupError::TooFewShapes`] below three, [`GroupError::ConstantCovariate`], and
/// [`GroupError::Count`] or [`GroupError::NotFinite`] for unsuitable numbers.
pub fn regress(
    coordinates: &[Vec<f64>],
    covariate: &[f64],
    relabelling: Relabelling,
) -> Result<Regression, GroupError> {
    let n = covariate.len();
    if n < 3 {
        return Err(GroupError::TooFewShapes { found: n });
    }
    check_table(coordinates, n)?;
    if let Some(index) = covariate.iter().position(|x| !x.is_finite()) {
        let what = "covariate";
        return Err(GroupError::NotFinite { what, index });
    }
    let modes = coordinates.first().map_or(0, Vec::len);
    let mean = covariate.iter().sum::<f64>() / n as f64;
    let centred: Vec<f64> = covariate.iter().map(|x| x - mean).collect();
    let square: f64 = centred.iter().map(|x| x * x).sum();
    if is_constant(covariate) {
        return Err(GroupError::ConstantCovariate);
    }
    let means: Vec<f64> = (0..modes)
        .map(|j| coordinates.iter().map(|row| row[j]).sum::<f64>() / n as f64)
        .collect();
    let totals: Vec<f64> = (0..modes)
        .map(|j| {
            coordinates
                .iter()
                .map(|row| (row[j] - means[j]).powi(2))
                .sum()
        })
        .collect();
    let products = |x: &[f64]| -> Vec<f64> {
        let sum = |j: usize| x.iter().zip(coordinates).map(|(x, row)| x * row[j]).sum();
        (0..modes).map(sum).collect()
    };
    let explained = |x: &[f64]| -> Vec<f64> {
        let products = products(x).into_iter();
        products.map(|product| product * product / square).collect()
    };
    let shares = |x: &[f64]| -> Vec<f64> {
        let pairs = explained(x).into_iter().zip(&totals);
        pairs
            .map(|(e, &t)| if t > 0.0 { e / t } else { 0.0 })
            .collect()
    };
    let p = relabelling.p_values(&centred, &shares);
    let overall = |x: &[f64]| vec![explained(x).iter().sum::<f64>()];
    let p_overall = relabelling.p_values(&centred, &overall);
    let slope: Vec<f64> = products(&centred).iter().map(|p| p / square).collect();
    let all: f64 = totals.iter().sum();
    Ok(Regression {
        intercept: means
            .iter()
            .zip(&slope)
            .map(|(m, b)| m - b * mean)
            .collect(),
        r_squared: shares(&centred),
        p_value: p.single,
        p_value_family_wise: p.largest,
        r_squared_overall: if all > 0.0 {
            overall(&centred)[0] / all
        } else {
            0.0
        },
        p_value_overall: p_overall.single[0],
        slope,
    })
}
