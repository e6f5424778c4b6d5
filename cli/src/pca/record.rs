//! The contents of `result.json`.

use std::time::Instant;

use hyperelastic::LawSpec;
use serde::Serialize;
use shape_pca::{Mahalanobis, Quality, Scores, SolveReport, Variation};

use super::args::{PcaConfig, ScoreConfig, SynthesizeConfig};
use super::balance::Continuation;
use super::command::Outcome;
use super::outliers::{Outlier, outliers};
use super::procrustes::Procrustes;
use crate::doubts::{named, of_repeated, of_source};
use crate::groups::GroupsRecord;
use crate::report::Record;
use crate::shapes::BoundaryRecord;
use crate::summary::Summary;

/// The contents of `result.json` of `shapespace pca`.
pub(super) type PcaRecord<'a, const D: usize> = Record<PcaConfig, Analysis<'a>, D>;

/// The result of an analysis.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Analysis<'a> {
    /// The checksum of the arrays of the average.
    #[serde(skip_serializing_if = "Option::is_none")]
    average_sum: Option<String>,
    /// The shapes of the average.
    shapes: &'a [String],
    #[serde(flatten)]
    groups: Option<GroupsRecord<'a>>,
    /// The labels of their components, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    labels: Vec<i64>,
    pub n_shapes: usize,
    pub weights: &'a [f64],
    /// The material of the average.
    #[serde(flatten)]
    law: LawSpec,
    void_stiffness: f64,
    pub n_modes: usize,
    /// All eigenvalues, in descending order, as many as shapes; the last are zero up to rounding.
    pub eigenvalues: &'a [f64],
    /// Relative to the first.
    pub ratios: Vec<f64>,
    /// `|sum u_k|` over the mean of `|u_k|` in `L^2`, before centring.
    pub balance: f64,
    /// `|sum lambda_k u_k| / sum lambda_k |u_k|`, at most 1.
    pub imbalance: f64,
    /// How the average was continued until its stresses balance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub continuation: Option<&'a Continuation>,
    /// Whether every curvature of the compound operator found by the solver is positive.
    pub definite: bool,
    /// The smallest curvature, relative to linear elasticity.
    pub least_curvature: f64,
    /// The scores of the training shapes, in standard deviations.
    scores: Vec<&'a [f64]>,
    /// Of the training shapes.
    #[serde(flatten)]
    pub distances: Distances,
    /// Square root of the weighted mean square of their `mahalanobis_over_n`: `sqrt(m/n)` with `m`
    /// modes of `n` shapes whose weight is not zero.
    pub mahalanobis_over_n_rms: f64,
    /// For every shape, the distance between `(1 - u_k)(S)` and the shape after a rigid alignment:
    /// root mean square distance of the boundaries relative to that of the shape's boundary from
    /// its centroid.
    procrustes: Vec<f64>,
    /// The same distance in length units of the unit box.
    procrustes_distance: Vec<f64>,
    /// Area or volume of the average object.
    object_size: f64,
    /// Ends of modes that are drawn, and have other parts, holes or tunnels than the average: parts of the moved
    /// average lie on each other.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub crossing_ends: Vec<String>,
    /// The coordinates of the boundaries of the mean and the modes.
    #[serde(flatten)]
    boundaries: BoundaryRecord,
    pub quality: &'a Quality,
    /// For every shape, the relative residual with the modes of the other shapes.
    left_out_residual: Vec<f64>,
    /// Shapes that lie unusually far from the others, in the modes of these.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outliers: Vec<Outlier<'a>>,
    solves: &'a [SolveReport],
}

/// Distances of shapes from the average.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Distances {
    /// `sqrt(sum score^2)` over the modes whose variance is not negligible.
    pub mahalanobis: Vec<f64>,
    /// Number of these modes.
    pub degrees_of_freedom: usize,
    /// Probability of at least this distance: for new shapes by Hotelling's law, for training shapes among these.
    pub p_value: Vec<f64>,
    /// `sqrt((1/n) sum score^2)` over all modes and `n` training shapes.
    mahalanobis_over_n: Vec<f64>,
}

impl Distances {
    pub fn of<'a>(shapes: impl IntoIterator<Item = &'a Scores>) -> Self {
        let all: Vec<Mahalanobis> = shapes.into_iter().map(|s| s.mahalanobis).collect();
        Self {
            mahalanobis: all.iter().map(|d| d.distance).collect(),
            degrees_of_freedom: all.first().map_or(0, |d| d.degrees_of_freedom),
            p_value: all.iter().map(|d| d.p_value).collect(),
            mahalanobis_over_n: all.iter().map(|d| d.over_n).collect(),
        }
    }
}

/// The record of a result. The time is measured up to this call.
pub(super) fn record<'a, const D: usize>(
    outcome: &'a Outcome<D>,
    (object_size, crossing_ends): (f64, Vec<String>),
    fits: &[Procrustes<D>],
    start: Instant,
) -> PcaRecord<'a, D> {
    let (stored, pca, quality) = (&outcome.stored, &outcome.pca, &outcome.quality);
    let weights = stored.average.weights();
    let distances = pca.training.iter().map(|s| s.mahalanobis.over_n);
    let squares = distances.zip(weights);
    let params = &pca.space.params;
    let found = Analysis {
        average_sum: stored.sums.digest(),
        shapes: &stored.names,
        groups: outcome
            .labelled
            .as_ref()
            .map(|labelled| labelled.record(|_| None)),
        labels: stored.components.iter().map(|c| c.label).collect(),
        n_shapes: stored.average.n_shapes(),
        weights,
        law: params.law,
        void_stiffness: params.void_stiffness,
        n_modes: pca.modes.rank(),
        eigenvalues: &pca.modes.eigenvalues,
        ratios: pca.ratios(),
        balance: pca.balance,
        imbalance: pca.imbalance(),
        continuation: outcome.continuation.as_ref(),
        definite: pca.definite(),
        least_curvature: pca.least_curvature,
        scores: pca.training.iter().map(|s| &*s.scores).collect(),
        distances: Distances::of(&pca.training),
        mahalanobis_over_n_rms: squares.map(|(d, w)| w * d * d).sum::<f64>().sqrt(),
        procrustes: fits.iter().map(|fit| fit.residual).collect(),
        procrustes_distance: fits.iter().map(|fit| fit.distance).collect(),
        object_size,
        crossing_ends,
        // Images have no boundaries.
        boundaries: if stored.image.is_some() {
            BoundaryRecord::default()
        } else {
            stored.place.record()
        },
        quality,
        left_out_residual: quality.left_out.iter().map(Scores::residual).collect(),
        outliers: outliers(&stored.names, quality),
        solves: &pca.solves,
    };
    let grid = stored.average.grid();
    let mut doubts = pca.doubts();
    doubts.extend(of_source(&stored.doubts));
    if let Some(continuation) = &outcome.continuation {
        doubts.extend(continuation.doubt(stored.params.min_determinant));
    }
    let counted = stored.input_sums.iter().zip(weights);
    doubts.extend(of_repeated(
        counted.map(|(sum, weight)| sum.as_deref().filter(|_| *weight > 0.0)),
    ));
    let doubts = named(&doubts, stored.names.iter().map(|name| &**name));
    Record::new(
        "complete",
        Some(grid),
        &outcome.config,
        found,
        doubts,
        start,
    )
    .within(stored.world.as_ref())
}

/// The summary of an analysis.
pub(super) fn summary<const D: usize>(record: &PcaRecord<'_, D>) -> Summary {
    let (found, seconds) = (&record.body, record.seconds);
    let title = format!(
        "{} modes of variation of {} shapes, {seconds:.1} s",
        found.n_modes, found.n_shapes
    );
    let mut summary = Summary::new(record, "modes.png", title);
    let ratios = found.ratios.iter().take(6).map(|r| format!("{r:.3}"));
    let ratios: Vec<String> = ratios.collect();
    let (first, ratios) = (found.eigenvalues[0], ratios.join(" "));
    summary.line("eigenvalues", format!("{first:.4e}, ratios {ratios}"));
    let (name, state) = variation(record);
    summary.line(name, state);
    if !found.outliers.is_empty() {
        let outliers: Vec<String> = found.outliers.iter().map(Outlier::in_words).collect();
        let text = format!("{}, in the modes of the other shapes", outliers.join(", "));
        summary.line("outliers", text);
    }
    if !found.crossing_ends.is_empty() {
        let ends = found.crossing_ends.join(", ");
        let remedy = "a smaller --amplitude, or synthesize --nonlinear, keeps them apart";
        summary.line(
            "pictures",
            format!("parts lie on each other in {ends}: {remedy}"),
        );
    }
    if let Some(done) = found.continuation.filter(|done| done.continued) {
        let before = 100.0 * done.report.imbalance.first().copied().unwrap_or_default();
        let rounds = done.report.imbalance.len().saturating_sub(1);
        let text = format!("continued from a balance of {before:.1} % in {rounds} rounds");
        summary.line("average", text);
    } else if found.continuation.is_some_and(|done| !done.report.balanced) {
        summary.line(
            "average",
            "could not be continued to balance, and is used as it is",
        );
    }
    summary
}

/// What the modes represent, and its state.
fn variation<const D: usize>(record: &PcaRecord<'_, D>) -> (&'static str, String) {
    let found = &record.body;
    if record.parameters.params.variation == Variation::Displacement {
        return ("variation", "displacements to the shapes, finite".into());
    }
    let state = if found.definite {
        "positive definite"
    } else {
        "NOT positive definite"
    };
    let balance = 100.0 * found.imbalance;
    let balanced = format!("balanced up to {balance:.1} %, object {state}");
    ("stresses", balanced)
}

/// The contents of `result.json` of `shapespace synthesize`.
pub(super) type SynthesisRecord<const D: usize> = Record<SynthesizeConfig, Synthesis, D>;

/// The result of a synthesis.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Synthesis {
    /// Fraction of the load that was reached; one for a linear synthesis.
    pub load_share: f64,
    /// Newton steps of every load step.
    pub iterations: Vec<usize>,
    /// Distance from the average.
    #[serde(flatten)]
    pub mahalanobis: Mahalanobis,
    /// Minimum determinant of the deformation of the average on the cells of the object: if it is
    /// not positive, the shape may intersect itself.
    pub min_det: f64,
    /// Area or volume of the shape and of the average.
    pub size: f64,
    pub average_size: f64,
    /// The coordinates of its boundary.
    #[serde(flatten)]
    pub boundaries: BoundaryRecord,
}

/// The contents of `result.json` of `shapespace score`.
pub(super) type ScoreRecord<const D: usize> = Record<ScoreConfig, Placements, D>;

/// The scores of new shapes.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Placements {
    /// Of every shape.
    #[serde(flatten)]
    pub distances: Distances,
    /// Of every shape, in standard deviations.
    pub scores: Vec<Vec<f64>>,
    /// For every shape, the relative residual of its displacement with all modes.
    pub residual: Vec<f64>,
    /// The same of the first `m` modes, `m = 0, 1, ...`.
    pub errors: Vec<Vec<f64>>,
    /// For every shape, the Dice overlap of its reconstruction by `m` modes with the mask.
    pub reconstruction_dice: Vec<Vec<f64>>,
    /// For every shape, root mean square distance of its boundary from the reconstruction by `m`
    /// modes, point by point after a rigid alignment, in length units of the unit box.
    pub reconstruction_distance: Vec<Vec<f64>>,
    /// Overlap of the shapes, deformed onto the average, with the average.
    pub dice: Vec<f64>,
    /// Stored energy of these deformations.
    pub elastic: Vec<f64>,
}
