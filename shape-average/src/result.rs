//! The result of an average.

use crate::energy::Energy;
use crate::error::AverageError;
use crate::level::LevelShapes;
use fe_grid::minimise::{Evaluations, LevelInfo, Status};
use fe_grid::{Certificate, Field, Grid, InverseDeformation, ScalarField, certify, parallel};
use levelset::{BoxEdge, Contour, Hausdorff, LevelsetError, contour, dice_within, hausdorff};
use serde::Serialize;

/// What happened on one level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelReport {
    /// Nodes along each axis, `x` first.
    pub nodes: Vec<usize>,
    /// Interface width `epsilon`.
    pub interface_width: f64,
    /// How the minimiser ended.
    pub status: Status,
    /// Accepted steps.
    pub iterations: usize,
    /// What was computed.
    pub evaluations: Evaluations,
    /// Evaluations of one shape's energy, with or without gradient.
    pub shape_evaluations: usize,
    /// Conjugate-gradient iterations of all solves for the average.
    pub average_iterations: usize,
    /// The functional before the first and after every accepted step.
    pub energies: Vec<f64>,
    /// The terms at the end.
    pub energy: Energy,
    /// The worst deformation at the end.
    pub certificate: Certificate,
    /// Wall time.
    pub seconds: f64,
}

/// The average of a number of shapes, on the finest level.
#[derive(Clone, Debug, Serialize)]
pub struct AverageResult<const D: usize> {
    /// The average phase field `v`.
    #[serde(skip)]
    pub average: ScalarField<f64, D>,
    /// Where the average object is: 1 inside, 0 outside. The weighted majority of the indicators
    /// of the shapes, pushed forward by their deformations; in a median each votes with its share.
    #[serde(skip)]
    pub average_mask: ScalarField<f64, D>,
    /// The weighted mean of those indicators, whose level 1/2 is the boundary of the average.
    #[serde(skip)]
    pub average_indicator: ScalarField<f64, D>,
    /// Displacements `u_i`, `phi_i(x) = x + u_i(x)` maps shape `i` to the average.
    #[serde(skip)]
    pub displacements: Vec<Field<f64, D, D>>,
    /// Signed distances of the shapes pushed forward, `d_i o phi_i^{-1}`: their zero levels are
    /// the shapes' boundaries seen in the average.
    #[serde(skip)]
    pub pushed: Vec<ScalarField<f64, D>>,
    /// The weights of what was seen of the shapes, pushed forward; none where everything was.
    #[serde(skip)]
    pub pushed_seen: Vec<ScalarField<f64, D>>,
    /// Phase fields and indicators of the shapes.
    #[serde(skip)]
    pub shapes: LevelShapes<D>,
    /// The terms of the functional.
    pub energy: Energy,
    /// The worst deformation: certified where the determinant is positive on all cells of all.
    pub certificate: Certificate,
    /// Dice overlap of each pushed-forward shape with the average, where the shape was seen.
    pub dice: Vec<f64>,
    /// Distance of the boundaries of each pushed-forward shape and of the average, where the shape
    /// was seen; none where one of the two has no boundary there.
    #[serde(skip)]
    pub hausdorff: Vec<Option<Hausdorff>>,
    /// What happened on each level, coarsest first.
    pub levels: Vec<LevelReport>,
    /// Of a median the sum of roots before the first and after every round; empty otherwise.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rounds: Vec<f64>,
    /// Converged, or the first level's reason why not.
    #[serde(skip)]
    pub status: Status,
    /// Wall time.
    #[serde(rename = "solver_seconds")]
    pub seconds: f64,
}

pub(crate) struct Timing {
    pub levels: Vec<LevelInfo>,
    pub seconds: f64,
}

impl<const D: usize> AverageResult<D> {
    pub(crate) fn new(
        signed_distances: &[Field<f64, D, 1>],
        votes: &[f64],
        shapes: LevelShapes<D>,
        x: &[f64],
        average: Vec<f64>,
        mut levels: Vec<LevelReport>,
        timing: &Timing,
    ) -> Result<Self, AverageError> {
        let grid = *shapes.grid();
        let dim = D * grid.n_nodes();
        for (report, info) in levels.iter_mut().zip(&timing.levels) {
            report.seconds = info.seconds;
        }
        let displacements: Result<Vec<_>, _> = x
            .chunks_exact(dim)
            .map(|u| Field::from_vec(grid, u.to_vec()))
            .collect();
        let displacements = displacements?;
        // A run that was cancelled ends on a coarser grid than that of the inputs.
        let distances: Vec<ScalarField<f64, D>> = signed_distances
            .iter()
            .map(|d| ScalarField::from_fn(grid, |x| d.sample(x)))
            .collect();
        let far = -grid.extent().iter().fold(0.0f64, |a, &b| a.max(b));
        let seen = shapes.seen();
        let pairs = parallel::map(displacements.iter().enumerate(), &|(i, u)| {
            let inverse = InverseDeformation::new(u);
            // Beyond the box everything was seen: nothing is there.
            let seen = seen.get(i).map(|seen| inverse.push_forward(seen, 1.0));
            (inverse.push_forward(&distances[i], far), seen)
        });
        let (pushed, pushed_seen): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
        let pushed_seen: Vec<_> = pushed_seen.into_iter().flatten().collect();
        let average_indicator = majority(&pushed, &pushed_seen, votes)?;
        let inside = |x: f64| if x > 0.5 { 1.0 } else { 0.0 };
        let mask = average_indicator
            .as_slice()
            .iter()
            .map(|&x| inside(x))
            .collect();
        let average_mask = ScalarField::from_vec(grid, mask)?;
        let measures = parallel::try_map(pushed.iter().enumerate(), &|(i, d)| {
            measure(d, &average_indicator, pushed_seen.get(i))
        });
        let (dice, hausdorff) = measures?.into_iter().unzip();
        Ok(Self {
            average: ScalarField::from_vec(grid, average)?,
            average_mask,
            average_indicator,
            displacements,
            pushed,
            pushed_seen,
            energy: levels.last().map(|l| l.energy.clone()).unwrap_or_default(),
            certificate: worst_certificate(&grid, x),
            dice,
            hausdorff,
            rounds: Vec::new(),
            status: overall_status(&levels),
            levels,
            shapes,
            seconds: timing.seconds,
        })
    }

    /// Evaluations of one shape's energy on all levels.
    pub fn shape_evaluations(&self) -> usize {
        self.levels.iter().map(|l| l.shape_evaluations).sum()
    }

    /// Mean Dice overlap.
    pub fn mean_dice(&self) -> f64 {
        self.dice.iter().sum::<f64>() / self.dice.len() as f64
    }
}

/// Where shapes of less weight than this were seen, none counts as seen.
const LEAST_VOTE: f64 = 1e-3;
/// A point was seen where the weight says more than this.
const SEEN: f64 = 0.5;

/// Weighted mean of the indicators of signed distances, each with a ramp one spacing wide, so
/// that a tie of two shapes ends half way between their boundaries. A shape votes where it was
/// seen; where none was, all vote.
fn majority<const D: usize>(
    pushed: &[ScalarField<f64, D>],
    seen: &[ScalarField<f64, D>],
    weights: &[f64],
) -> Result<ScalarField<f64, D>, AverageError> {
    let grid = *pushed[0].grid();
    let inverse_h = 1.0 / grid.spacing();
    let mean = (0..grid.n_nodes())
        .map(|node| {
            let ramp =
                |d: &ScalarField<f64, D>| (0.5 + d.as_slice()[node] * inverse_h).clamp(0.0, 1.0);
            let vote = |says: &dyn Fn(usize) -> f64| -> (f64, f64) {
                let votes = pushed.iter().zip(weights).enumerate();
                votes.fold((0.0, 0.0), |(sum, total), (i, (d, w))| {
                    (sum + w * says(i) * ramp(d), total + w * says(i))
                })
            };
            if seen.is_empty() {
                return vote(&|_| 1.0).0;
            }
            let (sum, total) = vote(&|i| seen[i].as_slice()[node]);
            if total > LEAST_VOTE {
                sum / total
            } else {
                vote(&|_| 1.0).0
            }
        })
        .collect();
    Ok(ScalarField::from_vec(grid, mean)?)
}

/// Overlap and distance of a pushed-forward shape with the average, where the shape was seen.
fn measure<const D: usize>(
    pushed: &ScalarField<f64, D>,
    indicator: &ScalarField<f64, D>,
    seen: Option<&ScalarField<f64, D>>,
) -> Result<(f64, Option<Hausdorff>), AverageError> {
    let overlap = match dice_within(pushed, 0.0, indicator, 0.5, seen) {
        // Nothing of either was seen, and nothing is known of an overlap.
        Err(LevelsetError::EmptyObject { .. }) if seen.is_some() => 0.0,
        found => found?,
    };
    let visible = |whole: Contour<D>| match seen {
        Some(seen) => whole.part(|corners| corners.iter().all(|x| seen.sample(*x)[0] > SEEN)),
        None => whole,
    };
    let own = contour(pushed, 0.0, BoxEdge::Open).map(visible);
    let average = contour(indicator, 0.5, BoxEdge::Open).map(visible);
    let distance = own.and_then(|own| hausdorff(&own, &average?)).ok();
    Ok((overlap, distance))
}

/// The certificate of the worst of all displacements, for a determinant above zero.
pub(crate) fn worst_certificate<const D: usize>(grid: &Grid<D>, x: &[f64]) -> Certificate {
    let parts = x.chunks_exact(D * grid.n_nodes());
    let certificates = parallel::map(parts, &|u| certify(grid, u, 0.0));
    let worst = certificates
        .iter()
        .copied()
        .reduce(|a, b| if b.min_det < a.min_det { b } else { a });
    worst.unwrap_or_else(|| certify(grid, &vec![0.0; D * grid.n_nodes()], 0.0))
}

/// Whether all levels ended as they should.
pub(crate) fn overall_status(reports: &[LevelReport]) -> Status {
    let bad = reports.iter().map(|r| r.status).find(|s| !s.converged());
    bad.unwrap_or(Status::EnergyTolerance)
}
