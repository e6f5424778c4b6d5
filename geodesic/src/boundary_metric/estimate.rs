//! The metric on two grids, for an estimate of its error.

use super::params::MetricParams;
use super::solve::{Flow, ShapeMetric};
use super::variation::Variation;
use crate::distances::richardson;
use crate::error::GeodesicError;
use crate::shape::on_grid;
use fe_grid::{ScalarField, compiled_once};

/// Order of the error in the spacing.
const ORDER: u32 = 2;

/// The metric with an estimate of its discretisation error.
#[derive(Clone, Debug)]
pub struct Estimate<const D: usize> {
    /// The flow on the grid of the distance.
    pub flow: Flow<D>,
    /// `G` on the grid of twice the spacing; `None` where there is none, or the shape is lost on it.
    pub half_grid: Option<f64>,
}

impl<const D: usize> Estimate<D> {
    /// The extrapolation of `G` to spacing zero, for an error of order two.
    pub fn extrapolated(&self) -> Option<f64> {
        let half = self.half_grid?;
        Some(richardson(half, self.flow.metric(), ORDER))
    }

    /// The estimated error of `G`: its distance from the extrapolation.
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
    ) -> Result<Estimate<D>, GeodesicError> = estimate_on_two_grids;
}

fn estimate_on_two_grids<const D: usize>(
    distance: &ScalarField<f64, D>,
    variation: &Variation<D>,
    params: &MetricParams,
) -> Result<Estimate<D>, GeodesicError> {
    let flow = ShapeMetric::new(distance, params)?.flow(variation)?;
    let half_grid = match distance.grid().coarser() {
        None => None,
        Some(grid) => match ShapeMetric::new(&on_grid(&grid, distance), params) {
            Ok(metric) => Some(metric.flow(variation)?.metric()),
            Err(GeodesicError::Degenerate { .. }) => None,
            Err(error) => return Err(error),
        },
    };
    Ok(Estimate { flow, half_grid })
}
