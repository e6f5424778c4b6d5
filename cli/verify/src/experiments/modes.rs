//! Covariance analysis of displacements, and its misprinted normalisation.

use nalgebra::DMatrix;
use shape_pca::{Modes, PcaError, SampleSize, Scores};

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::matrices::Sequence;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "modes-mahalanobis",
        reference: "section 5, d_M",
        claim: "With orthonormal modes Y = XO(nΛ)^(−1/2) the Mahalanobis distances of n training \
                shapes have the root mean square √((n−1)/n), so that d_M = 1 is one standard \
                deviation",
        broken: "the modes are XOΛ^(−1/2), as printed",
        run: mahalanobis,
    },
    Statement {
        name: "misprint-mode-normalisation",
        reference: "section 5, Y = XOΛ^(−1/2)",
        claim: "Modes as printed are not orthonormal: |y|² = n, and training distances have the \
                root mean square √(n−1)",
        broken: "the modes are XO(nΛ)^(−1/2), the corrected ones",
        run: printed,
    },
];

const SHAPES: usize = 7;
const DIMENSION: usize = 30;

/// `|y|^2` of the modes and the root mean square of the training distances, with the modes multiplied
/// by a factor.
fn analysed(factor: f64) -> Result<[f64; 2], PcaError> {
    let n = SHAPES;
    let mut numbers = Sequence::new(9);
    let mut x = DMatrix::from_fn(DIMENSION, n, |_, _| numbers.between(-1.0, 1.0));
    let mean = x.column_mean();
    for mut column in x.column_iter_mut() {
        column -= &mean;
    }
    let gram = x.transpose() * &x;
    let weights = vec![1.0 / n as f64; n];
    let modes = Modes::new(&gram, &weights, 1e-10, usize::MAX)?;
    let y = DMatrix::from_fn(n, modes.rank(), |i, j| factor * modes.combinations[j][i]);
    let fields = &x * y;
    let products = fields.transpose() * &fields;
    let mut square = 0.0;
    for u in x.column_iter() {
        let g: Vec<f64> = (fields.transpose() * u).iter().copied().collect();
        let scores = Scores::new(
            &g,
            u.norm_squared(),
            &modes.eigenvalues,
            SampleSize::equal(n),
        );
        square += scores.mahalanobis.over_n.powi(2) / n as f64;
    }
    Ok([products[(0, 0)], square.sqrt()])
}

fn mahalanobis(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let n = SHAPES as f64;
    let [size, root_mean_square] = analysed(setting.ingredient(1.0, n.sqrt()))?;
    let rounding = "rounding of sums and of an eigenvalue problem of seven";
    outcome.value(
        "root mean square of d_M of 7 shapes",
        root_mean_square,
        ((n - 1.0) / n).sqrt(),
        1e-10,
        rounding,
    );
    outcome.value("|y|² of the first mode", size, 1.0, 1e-10, rounding);
    Ok(outcome)
}

fn printed(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let n = SHAPES as f64;
    let [size, root_mean_square] = analysed(setting.ingredient(n.sqrt(), 1.0))?;
    let rounding = "rounding of sums and of an eigenvalue problem of seven";
    outcome.value("|y|² of the first mode", size, n, 1e-9, rounding);
    outcome.value(
        "root mean square of d_M of 7 shapes",
        root_mean_square,
        (n - 1.0).sqrt(),
        1e-9,
        rounding,
    );
    Ok(outcome)
}
