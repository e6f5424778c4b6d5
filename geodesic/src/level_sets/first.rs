//! A first path of level sets: a flow on a coarse grid, cut into small steps.

use super::flow::flow;
use super::state::PathState;
use crate::error::GeodesicError;
use crate::params::GeodesicParams;
use crate::shape::{Known, Shape};
use fe_grid::Grid;
use fe_grid::minimise::Observer;

/// Steps of the flow that make one of the first path, at most.
const FLOW_STEPS: usize = 6;

/// Paths from one shape to the other in `2^m` times as many steps as are wanted, on the grid of
/// the flow: the flow from start to end, and the one from end to start, backwards. Which of them is
/// near the shorter path is not known before both are lowered.
///
/// Nothing draws a flow where the shape it goes to is hidden, so that hidden parts are filled by
/// what flows there; but what is hidden at its start it cannot restore. Where one shape is hidden in
/// part, there is only the flow that ends there.
pub(crate) fn first_paths<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<(PathState<D>, Vec<PathState<D>>), GeodesicError> {
    let whole = [start, end].map(|shape| matches!(shape.known(), Known::Everywhere));
    let grid = start.grid().hierarchy(params.flow_nodes)[0];
    let mut forwards = || flow_path(start, end, &grid, params, observer);
    if whole[0] && !whole[1] {
        return Ok((forwards()?, Vec::new()));
    }
    let ahead = if whole[1] && !whole[0] {
        None
    } else {
        Some(forwards()?)
    };
    let back = flow_path(end, start, &grid, params, observer)?.reversed();
    Ok(match ahead {
        Some(ahead) => (ahead, vec![back]),
        None => (back, Vec::new()),
    })
}

/// The flow from one shape to another, cut.
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
