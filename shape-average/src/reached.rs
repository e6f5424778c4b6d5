//! What a minimisation has reached, on all processes, and the result that the first makes of it.

use crate::energy::Energy;
use crate::error::AverageError;
use crate::level::LevelShapes;
use crate::result::{AverageResult, LevelReport};
use crate::shapes::Shapes;
use fe_grid::Buffer;
use fe_grid::minimise::Status;
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
        AverageResult::new(
            inputs,
            &self.votes,
            self.shapes,
            self.x,
            self.average,
            self.reports,
            start,
        )
    }
}
