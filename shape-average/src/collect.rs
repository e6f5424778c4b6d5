//! What the first process has of all.

use crate::error::AverageError;
use fe_grid::{Distribution, Field, Grid};

/// The result of the only process.
pub(crate) fn of_first<R>(found: Option<R>) -> Result<R, AverageError> {
    found.ok_or(AverageError::NoShapes)
}

/// Fields of all shapes, in their order, on the first process, given those of the own shapes, as many for each; the
/// others keep their own. Collective.
///
/// # Errors
/// Those of fields.
pub(crate) fn collected<const D: usize, const M: usize>(
    own: Vec<Field<f64, D, M>>,
    grid: &Grid<D>,
    distribution: &Distribution,
) -> Result<Vec<Field<f64, D, M>>, AverageError> {
    if distribution.is_alone() {
        return Ok(own);
    }
    let values: Vec<f64> = own.iter().flat_map(Field::as_slice).copied().collect();
    let Some(all) = distribution.gather(&values) else {
        return Ok(own);
    };
    let fields = all.chunks_exact(M * grid.n_nodes());
    let fields: Result<Vec<_>, _> = fields
        .map(|field| Field::from_vec(*grid, field.to_vec()))
        .collect();
    Ok(fields?)
}
