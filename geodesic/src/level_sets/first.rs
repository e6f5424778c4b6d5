//! Initial path of level sets: a flow on a coarse grid, divided into small steps.

use super::flow::flow;
use super::state::PathState;
use crate::error::GeodesicError;
use crate::params::GeodesicParams;
use crate::shape::{Known, Shape};
use fe_grid::Grid;
use fe_grid::minimise::Observer;

/// Maximal number of steps of the flow per step of the initial path.
const FLOW_STEPS: usize = 6;

/// Computes paths from one shape to the other with `2^m` times the requested number of steps, on
/// the grid of the flow: the flow from start to end, and the reversed flow from end to start. Which
/// of them is close to the shorter path is known only after both are minimised.
///
/// No force acts on a flow where its target is hidden, so hidden parts are filled by the
/// surrounding flow; parts hidden at its start cannot be restored. If one shape is partially
/// hidden, only the flow that ends there is used.
pub(crate) fn first_paths<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Vec<PathState<D>>, GeodesicError> {
    let whole = [start, end].map(|shape| matches!(shape.known(), Known::Everywhere));
    let grid = start.grid().hierarchy(params.flow_nodes)[0];
    let mut paths = Vec::new();
    if whole[0] || !whole[1] {
        paths.push(flow_path(start, end, &grid, params, observer)?);
    }
    if whole[1] || !whole[0] {
        paths.push(flow_path(end, start, &grid, params, observer)?.reversed());
    }
    Ok(paths)
}

/// Computes the flow from one shape to another, divided into steps.
pub(crate) fn flow_path<const D: usize>(
    from: &Shape<D>,
    to: &Shape<D>,
    grid: &Grid<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<PathState<D>, GeodesicError> {
    let (from, to) = (from.on_grid(grid), to.on_grid(grid));
    let flow = flow(&from.components, &to, params, observer)?;
    let mut steps = params.steps;
    while steps * FLOW_STEPS < flow.motions.len() {
        steps *= 2;
    }
    Ok(flow.cut(steps))
}
