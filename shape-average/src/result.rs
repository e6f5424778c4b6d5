//! The result of an average.

use crate::collect::collected;
use crate::energy::Energy;
use crate::error::AverageError;
use crate::level::LevelShapes;
use crate::pushed::{Common, Pushed, SEEN};
use crate::shapes::Shapes;
use fe_grid::minimise::{Evaluations, Status};
use fe_grid::{Buffer, Certificate, Distribution, Field, Grid, ScalarField, certify, parallel};
use levelset::Hausdorff;
use serde::Serialize;
use std::time::Instant;

/// A shape that was deformed anew, by way of another one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rematch {
    /// The shape.
    pub shape: usize,
    /// The other one.
    pub by_way_of: usize,
    /// Its weighted terms of the functional before and after, for the average before.
    pub energies: [f64; 2],
}

/// A shape that overlaps much better after a rotation, from which the elastic energy is clearly smaller: with the first
/// shape, or with the one that fits the first one least; or with the average that it was deformed onto.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Turned {
    /// The shape.
    pub shape: usize,
    /// The angle of the rotation, in degrees.
    pub degrees: f64,
    /// The volume in which both differ at equal volumes, relative to that of their union: with the centroids in one place,
    /// and after the rotation.
    pub mismatches: [f64; 2],
}

/// Convergence history of one level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelReport {
    /// Nodes along each axis, `x` first.
    pub nodes: Vec<usize>,
    /// Interface width `epsilon`.
    pub interface_width: f64,
    /// Status of the minimiser at the end.
    pub status: Status,
    /// Number of accepted steps.
    pub iterations: usize,
    /// Evaluation counters.
    pub evaluations: Evaluations,
    /// Number of evaluations of one shape's energy, with or without gradient.
    pub shape_evaluations: usize,
    /// Conjugate-gradient iterations of all solves for the average.
    pub average_iterations: usize,
    /// The shapes that were deformed anew, by way of others.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rematched: Vec<Rematch>,
    /// Value of the functional before the first and after every accepted step.
    pub energies: Vec<f64>,
    /// Terms of the functional at the end.
    pub energy: Energy,
    /// The worst deformation at the end.
    pub certificate: Certificate,
    /// Wall time, in seconds.
    pub seconds: f64,
}

/// A component of the average, for shapes of several components.
#[derive(Clone, Debug, Serialize)]
pub struct ComponentResult<const D: usize> {
    /// Its phase field `v^c`.
    #[serde(skip)]
    pub average: ScalarField<f64, D>,
    /// Indicator of its object, as [`AverageResult::average_mask`].
    #[serde(skip)]
    pub average_mask: ScalarField<f64, D>,
    /// As [`AverageResult::average_indicator`], of the component.
    #[serde(skip)]
    pub average_indicator: ScalarField<f64, D>,
    /// Signed distances of the component of every shape, pushed forward.
    #[serde(skip)]
    pub pushed: Vec<ScalarField<f64, D>>,
    /// Dice overlap of the component of each pushed-forward shape with that of the average, on the visible
    /// part of the shape.
    pub dice: Vec<f64>,
    /// Distance between their boundaries there; `None` if one of them has none there.
    #[serde(skip)]
    pub hausdorff: Vec<Option<Hausdorff>>,
}

/// The average of a number of shapes, on the finest level; on that which was being minimised where an observer has
/// cancelled ([`Status::Cancelled`]). Fields are not serialised.
#[derive(Clone, Debug, Serialize)]
pub struct AverageResult<const D: usize> {
    /// The average phase field `v`; of several components the least of their phase fields, which is small
    /// on all of their boundaries.
    #[serde(skip)]
    pub average: ScalarField<f64, D>,
    /// The components of the average; empty if there is one. All other masks, distances and overlaps are
    /// those of the whole shapes.
    #[serde(skip)]
    pub components: Vec<ComponentResult<D>>,
    /// Indicator of the average object: 1 inside, 0 outside. It is the weighted majority of the
    /// indicators of the shapes, pushed forward by their deformations; in a median each weight is
    /// multiplied by the shape's share.
    #[serde(skip)]
    pub average_mask: ScalarField<f64, D>,
    /// The weighted mean of those indicators, whose level 1/2 is the boundary of the average.
    #[serde(skip)]
    pub average_indicator: ScalarField<f64, D>,
    /// Displacements `u_i`, `phi_i(x) = x + u_i(x)` maps shape `i` to the average.
    #[serde(skip)]
    pub displacements: Vec<Field<f64, D, D>>,
    /// Signed distances of the shapes pushed forward, `d_i o phi_i^{-1}`: their zero levels are the
    /// boundaries of the deformed shapes.
    #[serde(skip)]
    pub pushed: Vec<ScalarField<f64, D>>,
    /// Visibility masks of the shapes, pushed forward; empty if all shapes are fully visible.
    #[serde(skip)]
    pub pushed_visibility: Vec<ScalarField<f64, D>>,
    /// Phase fields and indicators of the shapes.
    #[serde(skip)]
    pub shapes: LevelShapes<D>,
    /// The terms of the functional.
    pub energy: Energy,
    /// Certificate of the worst deformation: certified if the determinant is positive on all cells
    /// of all deformations.
    pub certificate: Certificate,
    /// Dice overlap of each pushed-forward shape with the average, on the visible part of the
    /// shape.
    pub dice: Vec<f64>,
    /// Distance between the boundaries of each pushed-forward shape and of the average, on the
    /// visible part of the shape; `None` if one of the two has no boundary there.
    #[serde(skip)]
    pub hausdorff: Vec<Option<Hausdorff>>,
    /// Shapes of positive weight that lie turned among the others; not looked for where parts are hidden or faces are
    /// fixed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub turned: Vec<Turned>,
    /// Convergence history of each level, coarsest first.
    pub levels: Vec<LevelReport>,
    /// For a median, the sum of roots before the first and after every iteration; otherwise empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rounds: Vec<f64>,
    /// A converged status, or else the status of the first level that did not converge; a coarser level
    /// that reached its number of iterations does not count where the finest converged.
    #[serde(skip)]
    pub status: Status,
    /// Wall time, in seconds.
    #[serde(rename = "solver_seconds")]
    pub seconds: f64,
}

impl<const D: usize> AverageResult<D> {
    /// Measures the result on the first process; the others have none. `shapes` and `x`, their displacements, are
    /// those of this process, and the others' those of all. Collective.
    ///
    /// # Errors
    /// Those of the measures.
    pub(crate) fn new(
        inputs: Shapes<'_, D>,
        votes: &[f64],
        shapes: LevelShapes<D>,
        x: Buffer<f64>,
        average: Vec<f64>,
        levels: Vec<LevelReport>,
        start: Instant,
    ) -> Result<Option<Self>, AverageError> {
        let grid = *shapes.grid();
        let distribution = shapes.distribution().clone();
        let all = |own| collected(own, &grid, &distribution);
        let displacements: Result<Vec<_>, _> = x
            .chunks_exact(D * grid.n_nodes())
            .map(|u| Field::from_vec(grid, u.to_vec()))
            .collect();
        let displacements = displacements?;
        let certificate = worst_of_all(&grid, &x, &distribution);
        drop(x);
        let own = Pushed::new(inputs, &shapes, &displacements);
        let (pushed, pushed_visibility) = (all(own.whole)?, all(own.seen)?);
        let common = |pushed: &[ScalarField<f64, D>]| {
            Common::of(pushed, &pushed_visibility, votes, &grid, &distribution)
        };
        let whole = common(&pushed)?;
        let mut components = Vec::with_capacity(own.components.len());
        let averages = average.chunks_exact(grid.n_nodes());
        for (own, average) in own.components.into_iter().zip(averages) {
            let pushed = all(own)?;
            let found = common(&pushed)?;
            components.push(ComponentResult {
                average: ScalarField::from_vec(grid, average.to_vec())?,
                average_mask: found.mask,
                average_indicator: found.indicator,
                pushed,
                dice: found.dice,
                hausdorff: found.hausdorff,
            });
        }
        let displacements = collected(displacements, &grid, &distribution)?;
        let shapes = shapes.collected()?;
        if !distribution.is_first() {
            return Ok(None);
        }
        Ok(Some(Self {
            average: ScalarField::from_vec(grid, least(average, grid.n_nodes()))?,
            components,
            average_mask: whole.mask,
            average_indicator: whole.indicator,
            displacements,
            pushed,
            pushed_visibility,
            energy: levels.last().map(|l| l.energy.clone()).unwrap_or_default(),
            certificate,
            dice: whole.dice,
            hausdorff: whole.hausdorff,
            turned: Vec::new(),
            rounds: Vec::new(),
            status: overall_status(&levels),
            levels,
            shapes,
            seconds: start.elapsed().as_secs_f64(),
        }))
    }

    /// Returns the phase fields of all components of the average, one after the other.
    pub fn all_averages(&self) -> Vec<f64> {
        if self.components.is_empty() {
            return self.average.as_slice().to_vec();
        }
        let averages = self.components.iter().map(|c| c.average.as_slice());
        averages.collect::<Vec<_>>().concat()
    }

    /// Returns the number of evaluations of one shape's energy on all levels.
    pub fn shape_evaluations(&self) -> usize {
        self.levels.iter().map(|l| l.shape_evaluations).sum()
    }

    /// Returns the share of the average object at which no shape is visible; zero if all are fully visible.
    pub fn unseen_share(&self) -> f64 {
        if self.pushed_visibility.is_empty() {
            return 0.0;
        }
        let mask = self.average_mask.as_slice();
        let is_seen = |node: usize| {
            let mut masks = self.pushed_visibility.iter();
            masks.any(|seen| seen.as_slice()[node] > SEEN)
        };
        let inside = || (0..mask.len()).filter(|node| mask[*node] > 0.5);
        inside().filter(|node| !is_seen(*node)).count() as f64 / inside().count().max(1) as f64
    }

    /// Returns the mean Dice overlap.
    pub fn mean_dice(&self) -> f64 {
        self.dice.iter().sum::<f64>() / self.dice.len() as f64
    }
}

/// The least of fields that follow each other, at every node.
fn least(mut fields: Vec<f64>, n_nodes: usize) -> Vec<f64> {
    let (first, others) = fields.split_at_mut(n_nodes);
    for other in others.chunks_exact(n_nodes) {
        for (least, value) in first.iter_mut().zip(other) {
            *least = least.min(*value);
        }
    }
    fields.truncate(n_nodes);
    fields
}

/// Returns the certificate of the worst displacement, for positive determinants.
pub(crate) fn worst_certificate<const D: usize>(grid: &Grid<D>, x: &[f64]) -> Certificate {
    Certificate::worst(certificates(grid, x))
}

/// The certificate of the worst displacement of all processes. Collective.
pub(crate) fn worst_of_all<const D: usize>(
    grid: &Grid<D>,
    x: &[f64],
    distribution: &Distribution,
) -> Certificate {
    let numbers = |c: Certificate| {
        let certified = f64::from(u8::from(c.certified));
        [certified, c.min_det, c.min_corner_det, c.cell as f64]
    };
    let own: Vec<_> = certificates(grid, x).into_iter().map(numbers).collect();
    let all = distribution.share(&own).into_iter();
    Certificate::worst(
        all.map(|[certified, min_det, min_corner_det, cell]| Certificate {
            certified: certified > 0.0,
            min_det,
            min_corner_det,
            cell: cell as usize,
        }),
    )
}

/// Returns the certificate of every displacement.
fn certificates<const D: usize>(grid: &Grid<D>, x: &[f64]) -> Vec<Certificate> {
    let parts = x.chunks_exact(D * grid.n_nodes());
    parallel::map(parts, &|u| certify(grid, u, 0.0))
}

/// Returns `Status::EnergyTolerance` if the levels converged, else the status of the first that did
/// not.
pub(crate) fn overall_status(reports: &[LevelReport]) -> Status {
    let bad = unconverged(reports).next();
    bad.unwrap_or(Status::EnergyTolerance)
}

/// The statuses of the levels that did not converge. A coarser level that has reached its number of
/// iterations does not count where the finest converged: it only is where that began.
pub(crate) fn unconverged(reports: &[LevelReport]) -> impl Iterator<Item = Status> {
    let finest = reports.last().is_some_and(|r| r.status.converged());
    let statuses = reports.iter().map(|r| r.status);
    statuses.filter(move |s| !(s.converged() || finest && *s == Status::MaxIterations))
}
