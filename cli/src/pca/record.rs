//! What `result.json` tells.

use hyperelastic::LawSpec;
use serde::Serialize;
use shape_pca::{Quality, Scores, SolveReport};

use super::args::{PcaConfig, ScoreConfig, SynthesizeConfig};
use super::outcome::Outcome;
use super::procrustes::Procrustes;
use crate::report::Record;

/// Everything in `result.json` of `shapespace pca`.
pub(super) type PcaRecord<'a, const D: usize> = Record<PcaConfig, Analysis<'a>, D>;

/// What an analysis has found.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Analysis<'a> {
    /// The shapes of the average.
    shapes: &'a [String],
    pub n_shapes: usize,
    weights: &'a [f64],
    /// The material of the average.
    #[serde(flatten)]
    law: LawSpec,
    void_stiffness: f64,
    pub n_modes: usize,
    /// All of them, the largest first, as many as shapes; the last are zero up to rounding.
    pub eigenvalues: &'a [f64],
    /// Over the first.
    pub ratios: Vec<f64>,
    /// `|sum u_k|` over the mean of `|u_k|` in `L^2`, before centring.
    pub balance: f64,
    /// Whether all curvature of the compound operator that was met is positive.
    pub definite: bool,
    /// The least, relative to linear elasticity.
    pub least_curvature: f64,
    /// Of the training shapes.
    mahalanobis: Vec<f64>,
    /// Root of their weighted mean square: `sqrt((n-1)/n)` with all modes.
    pub mahalanobis_rms: f64,
    /// Of every shape, how far `(1 - u_k)(S)` is from it after a rigid motion: root mean square
    /// distance of the boundaries over that of the shape's from its centroid.
    procrustes: Vec<f64>,
    /// The same distance in lengths of the unit box.
    procrustes_distance: Vec<f64>,
    /// Area or volume of the average object.
    object_size: f64,
    pub quality: &'a Quality,
    /// What the modes of the others leave of every shape, relative.
    left_out_residual: Vec<f64>,
    solves: &'a [SolveReport],
}

/// The record of a result. The time is measured up to this call.
pub(super) fn record<'a, const D: usize>(
    outcome: &'a Outcome<'a, D>,
    object_size: f64,
    fits: &[Procrustes<D>],
) -> PcaRecord<'a, D> {
    let (stored, pca, quality) = (outcome.stored, outcome.pca, &outcome.quality);
    let weights = stored.average.weights();
    let mahalanobis: Vec<f64> = pca.training.iter().map(|s| s.mahalanobis).collect();
    let squares = mahalanobis.iter().zip(weights);
    let params = &pca.space.params;
    let found = Analysis {
        shapes: &stored.names,
        n_shapes: stored.average.n_shapes(),
        weights,
        law: params.law,
        void_stiffness: params.void_stiffness,
        n_modes: pca.modes.rank(),
        eigenvalues: &pca.modes.eigenvalues,
        ratios: pca.ratios(),
        balance: pca.balance,
        definite: pca.definite(),
        least_curvature: pca.least_curvature,
        mahalanobis_rms: squares.map(|(d, w)| w * d * d).sum::<f64>().sqrt(),
        mahalanobis,
        procrustes: fits.iter().map(|fit| fit.residual).collect(),
        procrustes_distance: fits.iter().map(|fit| fit.distance).collect(),
        object_size,
        quality,
        left_out_residual: quality.left_out.iter().map(Scores::residual).collect(),
        solves: &pca.solves,
    };
    let nodes = stored.average.grid().nodes_per_axis();
    Record::new("complete", &nodes, outcome.config, found, outcome.start)
}

/// Everything in `result.json` of `shapespace synthesize`.
pub(super) type SynthesisRecord<const D: usize> = Record<SynthesizeConfig, Synthesis, D>;

/// What a synthesis has found.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Synthesis {
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
}

/// Everything in `result.json` of `shapespace score`.
pub(super) type ScoreRecord<const D: usize> = Record<ScoreConfig, Placements, D>;

/// Where new shapes lie.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Placements {
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
}
