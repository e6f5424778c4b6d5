//! What `result.json` tells.

use serde::Serialize;

use super::args::{Metric, Size};
use super::outcome::Outcome;
use super::procrustes::Procrustes;

/// Everything in `result.json` of `shapespace pca`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct PcaRecord {
    pub version: &'static str,
    pub status: &'static str,
    pub dimension: usize,
    /// Nodes along each axis of the arrays, `x` first.
    pub nodes: Vec<usize>,
    /// The directory of the average.
    pub average: String,
    /// Its shapes.
    pub shapes: Vec<String>,
    pub n_shapes: usize,
    pub weights: Vec<f64>,
    pub metric: Metric,
    /// Whether the compound object was under the stresses of the deformations.
    pub prestressed: bool,
    pub tolerance: f64,
    pub void_stiffness: f64,
    pub n_modes: usize,
    /// All of them, the largest first, as many as shapes; the last are zero up to rounding.
    pub eigenvalues: Vec<f64>,
    /// Over the first.
    pub ratios: Vec<f64>,
    /// `|sum u_k|` over the mean of `|u_k|` in `L^2`, before centring.
    pub balance: f64,
    /// Whether all curvature of the compound operator that was met is positive.
    pub definite: bool,
    /// The least, relative to linear elasticity.
    pub least_curvature: f64,
    /// Of the training shapes.
    pub mahalanobis: Vec<f64>,
    /// Root of their weighted mean square: `sqrt((n-1)/n)` with all modes.
    pub mahalanobis_rms: f64,
    /// Of every shape, how far `(1 - u_k)(S)` is from it after a rigid motion: root mean square
    /// distance of the boundaries over that of the shape's from its centroid.
    pub procrustes: Vec<f64>,
    /// The same distance in lengths of the unit box.
    pub procrustes_distance: Vec<f64>,
    /// Area or volume of the average object.
    pub object_size: f64,
    pub quality: QualityRecord,
    pub solves: Vec<SolveRecord>,
    pub seconds: f64,
}

/// Compactness, generalisation and specificity.
#[derive(Clone, Debug, Serialize)]
pub(super) struct QualityRecord {
    pub compactness: Vec<f64>,
    pub generalisation: Vec<f64>,
    pub specificity: Vec<f64>,
    /// Of every shape in the modes of the others.
    pub left_out_mahalanobis: Vec<f64>,
    /// What the modes of the others leave of it, relative.
    pub left_out_residual: Vec<f64>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct SolveRecord {
    iterations: usize,
    residual: f64,
}

impl PcaRecord {
    /// The record of an outcome. The time is that until now.
    pub fn new<const D: usize>(
        outcome: &Outcome<'_, D>,
        object_size: f64,
        fits: &[Procrustes<D>],
    ) -> Self {
        let (given, pca, quality) = (outcome.given, outcome.pca, &outcome.quality);
        let weights = given.average.weights();
        let mahalanobis: Vec<f64> = pca.training.iter().map(|s| s.mahalanobis).collect();
        let squares = mahalanobis.iter().zip(weights);
        let average = &outcome.args.average;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            status: "complete",
            dimension: D,
            nodes: given.average.grid().nodes_per_axis().to_vec(),
            average: std::fs::canonicalize(average)
                .unwrap_or_else(|_| average.clone())
                .display()
                .to_string(),
            shapes: given.names.clone(),
            n_shapes: given.average.n_shapes(),
            weights: weights.to_vec(),
            metric: outcome.args.metric,
            prestressed: !pca.space.params.at_rest,
            tolerance: pca.space.params.tolerance,
            void_stiffness: pca.space.params.void_stiffness,
            n_modes: pca.modes.rank(),
            eigenvalues: pca.modes.eigenvalues.clone(),
            ratios: pca.ratios(),
            balance: pca.balance,
            definite: pca.definite(),
            least_curvature: pca.least_curvature,
            mahalanobis_rms: squares.map(|(d, w)| w * d * d).sum::<f64>().sqrt(),
            mahalanobis,
            procrustes: fits.iter().map(|fit| fit.residual).collect(),
            procrustes_distance: fits.iter().map(|fit| fit.distance).collect(),
            object_size,
            quality: QualityRecord {
                compactness: quality.compactness.clone(),
                generalisation: quality.generalisation.clone(),
                specificity: quality.specificity.clone(),
                left_out_mahalanobis: quality.left_out.iter().map(|s| s.mahalanobis).collect(),
                left_out_residual: quality
                    .left_out
                    .iter()
                    .map(shape_pca::Scores::residual)
                    .collect(),
            },
            solves: pca
                .solves
                .iter()
                .map(|solve| SolveRecord {
                    iterations: solve.iterations,
                    residual: solve.residual,
                })
                .collect(),
            seconds: outcome.start.elapsed().as_secs_f64(),
        }
    }
}

/// Everything in `result.json` of `shapespace synthesize`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SynthesisRecord {
    pub version: &'static str,
    pub status: &'static str,
    pub dimension: usize,
    pub nodes: Vec<usize>,
    pub pca: String,
    pub scores: Vec<f64>,
    pub nonlinear: bool,
    /// Share of the load that was reached; one for a linear synthesis.
    pub load_share: f64,
    /// Newton steps of every load step.
    pub iterations: Vec<usize>,
    /// `sqrt((1/n) sum score^2)`.
    pub mahalanobis: f64,
    /// The least determinant of the deformation of the average on the cells of the object: where it
    /// is not positive the shape may cut itself.
    pub min_det: f64,
    /// Area or volume of the shape and of the average.
    pub size: f64,
    pub average_size: f64,
    pub seconds: f64,
}

/// Everything in `result.json` of `shapespace score`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ScoreRecord {
    pub version: &'static str,
    pub status: &'static str,
    pub dimension: usize,
    pub nodes: Vec<usize>,
    pub pca: String,
    pub size: Size,
    /// The shapes.
    pub shapes: Vec<String>,
    /// Of every shape.
    pub mahalanobis: Vec<f64>,
    /// Of every shape, in standard deviations.
    pub scores: Vec<Vec<f64>>,
    /// Of every shape, what all modes leave of its displacement, relative.
    pub residual: Vec<f64>,
    /// The same of the first `m` modes, `m = 0, 1, ...`.
    pub errors: Vec<Vec<f64>>,
    /// Of every shape, the Dice overlap of what `m` modes make of it with the mask itself.
    pub reconstruction_dice: Vec<Vec<f64>>,
    /// Of every shape, root mean square distance of its boundary from what `m` modes make of it,
    /// point by point after a rigid motion, in lengths of the unit box.
    pub reconstruction_distance: Vec<Vec<f64>>,
    /// Overlap of the shapes, deformed onto the average, with the average.
    pub dice: Vec<f64>,
    /// Stored energy of these deformations.
    pub elastic: Vec<f64>,
    pub seconds: f64,
}
