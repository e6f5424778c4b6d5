//! Covariance analysis of displacements, and its misprinted normalisation.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use nalgebra::DMatrix;
use shape_average::{AverageParams, average};
use shape_pca::{Average, Compound, Modes, Pca, PcaError, PcaParams, SampleSize, Scores};

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::matrices::Sequence;
use crate::tools::shapes::segments;

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
        name: "modes-pins",
        reference: "section 5, pins",
        claim: "Two pins at different places are not taken for one that is shifted: the average has a low pin \
                at either place, and in its mode one of them grows while the other shrinks",
        broken: "both pins stand nearly at the same place",
        run: pins,
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

/// Places of the pins, their height over the block, and that of the block.
const PLACES: [f64; 2] = [0.36, 0.64];
const HEIGHT: f64 = 0.08;
const TOP: f64 = 0.54;

/// A block with a pin on it.
fn block(grid: Grid<2>, place: f64) -> Result<ScalarField<f64, 2>, VerifyError> {
    let radius = 0.05;
    segments(
        grid,
        &[
            ([0.3, 0.4], [0.7, 0.4], TOP - 0.4),
            ([place, 0.5], [place, TOP + HEIGHT - radius], radius),
        ],
    )
}

/// Where a shape ends above a place, from its indicator.
fn top(indicator: &ScalarField<f64, 2>, place: f64) -> f64 {
    let (mut inside, mut outside) = (TOP - 0.1, 0.9);
    // The indicator falls along the way out of the shape, and is smooth between the nodes.
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        if indicator.sample([place, middle])[0] > 0.5 {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

fn pins(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let grid = Grid::<2>::dyadic(setting.effort(6, 7));
    let shapes = [
        block(grid, PLACES[0])?,
        block(grid, setting.ingredient(PLACES[1], PLACES[0] + 0.04))?,
    ];
    let params = AverageParams::default();
    let result = average(&shapes, &params, &mut Silent)?;
    let tops = PLACES.map(|place| top(&result.average_indicator, place));
    for (top, place) in tops.iter().zip(PLACES) {
        outcome.value(
            format!("height of the average over the block at {place}, over that of a pin"),
            (top - TOP) / HEIGHT,
            0.5,
            0.2,
            "half a pin by symmetry",
        );
    }
    let weights = params.resolved_weights(shapes.len());
    let objects = Average::new(result.displacements, result.shapes.indicators, weights)?;
    let analysis = PcaParams {
        at_rest: true,
        ..PcaParams::default()
    };
    let compound = Compound::new(&objects, &analysis)?;
    let pca = Pca::new(&objects, &compound, usize::MAX, &mut Silent)?;
    let raised = [0, 1].map(|k| {
        let mode = pca.space.fields.first();
        mode.map_or(0.0, |mode| mode.sample([PLACES[k], tops[k]])[1])
    });
    outcome.value(
        "displacement of the second pin by the mode over that of the first",
        raised[1] / raised[0],
        -1.0,
        0.3,
        "one grows while the other shrinks, by symmetry as much",
    );
    Ok(outcome)
}
