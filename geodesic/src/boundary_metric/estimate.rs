//! The metric on two grids, and of a shape that is sampled more coarsely, for an estimate of its error.

use super::params::MetricParams;
use super::solve::{Flow, ShapeMetric};
use super::variation::Variation;
use crate::distances::richardson;
use crate::error::GeodesicError;
use fe_grid::minimise::{Control, Observer};
use fe_grid::{Grid, ScalarField, compiled_once};
use levelset::{BoxEdge, ContourDistance, LevelsetError, contour};

/// Order of the error in the spacing. That in the distance of the samples of a mask is at least as high:
/// on disks it falls by factors of 4 to 6 with half the distance.
const ORDER: u32 = 2;
/// Factor of the distance of the samples for the estimate of their error.
const COARSER: f64 = 2.0;
/// Places of the coarser samples, in their distances. The error of a single place may be small by chance.
const PLACES: [f64; 2] = [0.0, 0.5];
/// Least tolerance of their flows. `G` is off by about half of it: changes of less than a hundredth of `G` are known
/// roughly, which makes no difference to a result that is that well known.
const TOLERANCE: f64 = 3e-3;
/// Least distance of the coarser samples, in spacings of the grid, which bounds their number.
const LEAST_DISTANCE: f64 = 0.5;

/// The metric with an estimate of its discretisation error.
#[derive(Clone, Debug)]
pub struct Estimate<const D: usize> {
    /// The flow on the grid of the distance.
    pub flow: Flow<D>,
    /// `G` on the grid of twice the spacing; `None` where there is none, or the shape is lost on it.
    pub half_grid: Option<f64>,
    /// The estimated error of `G` by the boundary of a mask of two values, whose steps are of the size of
    /// its samples; `None` for a shape that is not given by such a mask, or that is lost at twice the
    /// distance of the samples. On disks it is one to six times the true error, where that is larger than the error by
    /// the grid.
    pub sampling_error: Option<f64>,
}

impl<const D: usize> Estimate<D> {
    /// The extrapolation of `G` to spacing zero, for an error of order two.
    pub fn extrapolated(&self) -> Option<f64> {
        let half = self.half_grid?;
        Some(richardson(half, self.flow.metric(), ORDER))
    }

    /// The estimated error of `G` by the spacing of the grid: its distance from the extrapolation. It does not
    /// contain the error of the boundary itself.
    pub fn error(&self) -> Option<f64> {
        Some((self.extrapolated()? - self.flow.metric()).abs())
    }
}

compiled_once! {
    /// Computes the optimal velocity of a variation of the shape `{u > 0}`, and `G` on the grid of twice
    /// the spacing.
    ///
    /// # Errors
    /// As [`ShapeMetric::new`] and [`ShapeMetric::flow`].
    pub fn estimate<'a, D>(
        distance: &'a ScalarField<f64, D>,
        variation: &'a Variation<D>,
        params: &'a MetricParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Estimate<D>, GeodesicError> = estimate_on_two_grids;
}

compiled_once! {
    /// The same for a shape that is given by a mask of two values, with samples at this distance: also
    /// computes `G` of the shape that is sampled at twice the distance.
    ///
    /// # Errors
    /// As [`estimate`], and [`GeodesicError::Parameter`] for a distance that is not positive.
    pub fn estimate_of_mask<'a, D>(
        distance: &'a ScalarField<f64, D>,
        samples: f64,
        variation: &'a Variation<D>,
        params: &'a MetricParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Estimate<D>, GeodesicError> = estimate_with_samples;
}

fn estimate_with_samples<const D: usize>(
    distance: &ScalarField<f64, D>,
    samples: f64,
    variation: &Variation<D>,
    params: &MetricParams,
    observer: &mut dyn Observer,
) -> Result<Estimate<D>, GeodesicError> {
    if !(samples > 0.0 && samples.is_finite()) {
        return Err(GeodesicError::Parameter {
            name: "the distance of the samples",
            expected: "a positive number",
            value: samples,
        });
    }
    let mut found = estimate_on_two_grids(distance, variation, params, observer)?;
    let coarser = f64::max(
        COARSER * samples,
        LEAST_DISTANCE * distance.grid().spacing(),
    );
    let growth = (coarser / samples).powi(ORDER as i32) - 1.0;
    let params = MetricParams {
        tolerance: params.tolerance.max(TOLERANCE),
        ..*params
    };
    for place in PLACES {
        let Some(coarse) = sampled_at(distance, coarser, place * coarser)? else {
            continue;
        };
        let Some(metric) = metric_unless_stopped(&coarse, variation, &params, observer)? else {
            continue;
        };
        let change = (metric - found.flow.metric()).abs();
        let error = found.sampling_error.unwrap_or(0.0);
        found.sampling_error = Some(error.max(change / growth));
    }
    Ok(found)
}

/// The signed distance to the boundary of a shape that is sampled as a mask of two values, beginning so far
/// before the corner of the box along every axis; `None` if no sample lies inside.
fn sampled_at<const D: usize>(
    distance: &ScalarField<f64, D>,
    samples: f64,
    before: f64,
) -> Result<Option<ScalarField<f64, D>>, GeodesicError> {
    let grid = *distance.grid();
    let counts = grid
        .extent()
        .map(|side| ((side + before) / samples).ceil() as usize + 1);
    let lattice = Grid::with_nodes(counts, samples)?;
    let mask = ScalarField::<f64, D>::from_fn(lattice, |x| {
        let u = distance.sample(x.map(|x| x - before));
        [f64::from(u8::from(u[0] > 0.0))]
    });
    let outline = contour(&mask, 0.5, BoxEdge::Closed)?.map(|p| p.map(|x| x - before));
    match ContourDistance::new(&outline) {
        Ok(exact) => Ok(Some(exact.sample(grid))),
        Err(LevelsetError::EmptyContour) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

fn estimate_on_two_grids<const D: usize>(
    distance: &ScalarField<f64, D>,
    variation: &Variation<D>,
    params: &MetricParams,
    observer: &mut dyn Observer,
) -> Result<Estimate<D>, GeodesicError> {
    let flow = ShapeMetric::new(distance, params)?.flow(variation, observer)?;
    let half_grid = match distance.grid().coarser() {
        None => None,
        Some(grid) => metric_unless_stopped(&distance.on_grid(&grid), variation, params, observer)?,
    };
    Ok(Estimate {
        flow,
        half_grid,
        sampling_error: None,
    })
}

/// `G` of the variation at another shape; `None` if that is empty, or the observer cancels.
fn metric_unless_stopped<const D: usize>(
    distance: &ScalarField<f64, D>,
    variation: &Variation<D>,
    params: &MetricParams,
    observer: &mut dyn Observer,
) -> Result<Option<f64>, GeodesicError> {
    if observer.between() == Control::Cancel {
        return Ok(None);
    }
    let flow = match ShapeMetric::new(distance, params) {
        Ok(metric) => metric.flow(variation, observer)?,
        Err(GeodesicError::Degenerate { .. }) => return Ok(None),
        Err(error) => return Err(error),
    };
    Ok(Some(flow.metric()).filter(|_| observer.between() == Control::Continue))
}
