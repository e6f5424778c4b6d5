//! What a minimisation has reached, on all processes, and the result that the first makes of it.

use crate::energy::Energy;
use crate::error::AverageError;
use crate::level::LevelShapes;
use crate::result::{AverageResult, LevelReport};
use crate::shapes::Shapes;
use fe_grid::minimise::Status;
use fe_grid::{Buffer, Distribution, Field};
use std::time::Instant;

/// What a minimisation on all levels has reached.
pub(crate) struct Reached<const D: usize> {
    /// The shapes of this process on the last level that was reached.
    pub shapes: LevelShapes<D>,
    /// Their displacements.
    pub x: Buffer<f64>,
    /// The average, component by component.
    pub average: Vec<f64>,
    pub reports: Vec<LevelReport>,
    /// Weight of every shape in the vote on the average object.
    pub votes: Vec<f64>,
}

impl<const D: usize> Reached<D> {
    /// The terms of the functional.
    pub fn energy(&self) -> Energy {
        let last = self.reports.last();
        last.map(|report| report.energy.clone()).unwrap_or_default()
    }

    /// Whether the minimisation was cancelled.
    pub fn cancelled(&self) -> bool {
        let last = self.reports.last();
        last.is_some_and(|report| report.status == Status::Cancelled)
    }

    /// The displacements of the shapes of this process.
    pub fn displacements(&self) -> Vec<&[f64]> {
        let dim = D * self.shapes.grid().n_nodes();
        self.x.chunks_exact(dim).collect()
    }

    /// Measures the result on the first process; the others have none. Collective.
    ///
    /// # Errors
    /// Those of the measures.
    pub fn into_result(
        self,
        inputs: Shapes<'_, D>,
        start: Instant,
    ) -> Result<Option<AverageResult<D>>, AverageError> {
        let distribution = self.shapes.distribution().clone();
        let (shapes, x) = if distribution.is_alone() {
            (self.shapes, self.x)
        } else {
            let x = distribution.gather(&self.x);
            let shapes = gathered(&self.shapes, &distribution)?;
            let (Some(x), Some(shapes)) = (x, shapes) else {
                return Ok(None);
            };
            (shapes, Buffer::from(x))
        };
        let result = AverageResult::new(
            inputs,
            &self.votes,
            shapes,
            &x,
            self.average,
            self.reports,
            start,
        );
        result.map(Some)
    }
}

/// The shapes of all processes on the first one.
fn gathered<const D: usize>(
    own: &LevelShapes<D>,
    distribution: &Distribution,
) -> Result<Option<LevelShapes<D>>, AverageError> {
    let grid = *own.grid();
    let gather =
        |fields: &[Field<f64, D, 1>]| -> Result<Option<Vec<Field<f64, D, 1>>>, AverageError> {
            let values: Vec<f64> = fields.iter().flat_map(Field::as_slice).copied().collect();
            let Some(all) = distribution.gather(&values) else {
                return Ok(None);
            };
            let fields = all.chunks_exact(grid.n_nodes());
            let fields: Result<Vec<_>, _> =
                fields.map(|f| Field::from_vec(grid, f.to_vec())).collect();
            Ok(Some(fields?))
        };
    let (phase_fields, indicators) = (gather(&own.phase_fields)?, gather(&own.indicators)?);
    let seen = gather(own.seen())?;
    let (Some(phase_fields), Some(indicators), Some(seen)) = (phase_fields, indicators, seen)
    else {
        return Ok(None);
    };
    let (width, components) = (own.interface_width(), own.n_components());
    let all = LevelShapes::from_components(grid, width, components, phase_fields, indicators);
    Ok(Some(all.with_visibility(seen)))
}
