//! The shapes of a figure, and how they are averaged.

use std::cell::RefCell;

use fe_grid::transfer::inject_into;
use fe_grid::{Distribution, Grid, ScalarField};
use levelset::{BoxEdge, Contour, Doubt, contour, hausdorff};
use shape_average::{
    AverageError, AverageParams, AverageResult, Shapes, average_of_components, memory_estimate,
};

use crate::checkpoint::Checkpointer;
use crate::error::CliError;
use crate::session::Session;

/// The shapes of a figure.
pub(super) struct Scene<'a, const D: usize> {
    /// Their labels.
    pub names: Vec<String>,
    /// Their signed distances.
    pub distances: Vec<ScalarField<f64, D>>,
    /// The labels of their components, of the figure about these.
    pub labels: Vec<i64>,
    /// The signed distances of the components, all of the first shape before those of the second.
    pub parts: Vec<ScalarField<f64, D>>,
    /// The parameters that a figure starts from.
    pub params: AverageParams,
    /// The doubts about the averages so far.
    pub doubts: RefCell<Vec<Doubt>>,
    /// Numbers of shapes that are compared with each other, in the order of the shapes.
    pub groups: Vec<usize>,
    pub session: &'a Session<'a>,
    /// The checkpoints of all that is computed, one after the other.
    pub checkpointer: RefCell<Checkpointer<'a>>,
}

impl<const D: usize> Scene<'_, D> {
    /// The finest grid.
    pub fn grid(&self) -> Grid<D> {
        *self.distances[0].grid()
    }

    /// Number of shapes.
    pub fn n_shapes(&self) -> usize {
        self.distances.len()
    }

    /// Estimates the memory of a figure, in bytes: of its shapes and of one of its averages, which follow each other
    /// and need more than a path between two of the shapes does.
    pub fn memory(&self) -> u64 {
        let (n, grid) = (self.n_shapes(), self.grid());
        let components = self.labels.len().max(1);
        let of_average = memory_estimate(
            &self.params,
            &Distribution::alone(n),
            components,
            false,
            &grid,
        );
        let fields = (n + self.parts.len()) * grid.n_nodes();
        of_average.memory + (fields * size_of::<f64>()) as u64
    }

    /// The average of all shapes with some parameters changed.
    ///
    /// # Errors
    /// Those of the average, and [`CliError::Stopped`] where Ctrl-C has been pressed.
    pub fn average(
        &self,
        what: &str,
        change: impl FnOnce(&mut AverageParams),
    ) -> Result<AverageResult<D>, CliError> {
        self.average_of(what, &self.distances, &[], change)
    }

    /// The same for other shapes with these visibility weights.
    ///
    /// # Errors
    /// As [`Self::average`].
    pub fn average_of(
        &self,
        what: &str,
        distances: &[ScalarField<f64, D>],
        visibility: &[ScalarField<f64, D>],
        change: impl FnOnce(&mut AverageParams),
    ) -> Result<AverageResult<D>, CliError> {
        self.run(what, Shapes::new(distances), visibility, change)
    }

    /// The same for shapes of several components.
    ///
    /// # Errors
    /// As [`Self::average`].
    pub fn average_of_shapes(
        &self,
        what: &str,
        shapes: Shapes<'_, D>,
        change: impl FnOnce(&mut AverageParams),
    ) -> Result<AverageResult<D>, CliError> {
        self.run(what, shapes, &[], change)
    }

    fn run(
        &self,
        what: &str,
        shapes: Shapes<'_, D>,
        visibility: &[ScalarField<f64, D>],
        change: impl FnOnce(&mut AverageParams),
    ) -> Result<AverageResult<D>, CliError> {
        let mut params = self.params.clone();
        change(&mut params);
        self.session.progress.note(format!("{what}:"));
        let grids = shapes.whole()[0].grid().hierarchy(params.coarsest_nodes);
        let mut checkpointer = self.checkpointer.borrow_mut();
        let mut watch = checkpointer.observe(self.session.observer(&grids));
        let result = average_of_components(shapes, visibility, &[], &params, &mut watch)?;
        watch.finish();
        if self.session.interrupt.asked() {
            return Err(CliError::Stopped);
        }
        self.doubts.borrow_mut().extend(result.doubts(&params));
        Ok(result)
    }

    /// The shapes on the grid coarsened this number of times; `None` if there is none.
    pub fn coarser(&self, times: usize) -> Option<Vec<ScalarField<f64, D>>> {
        let mut distances = self.distances.clone();
        for _ in 0..times {
            let grid = distances[0].grid().coarser()?;
            distances = distances
                .iter()
                .map(|fine| {
                    let mut coarse = ScalarField::zeros(grid);
                    inject_into(&grid, fine.as_slice(), coarse.as_mut_slice());
                    coarse
                })
                .collect();
        }
        Some(distances)
    }
}

/// The boundary of an average.
///
/// # Errors
/// [`AverageError`] where there is none.
pub(super) fn outline<const D: usize>(
    result: &AverageResult<D>,
) -> Result<Contour<D>, AverageError> {
    Ok(contour(&result.average_indicator, 0.5, BoxEdge::Closed)?)
}

/// The mean distance of two boundaries, in unit boxes.
///
/// # Errors
/// [`AverageError`] where one of them does not exist.
pub(super) fn distance<const D: usize>(
    a: &Contour<D>,
    b: &Contour<D>,
) -> Result<f64, AverageError> {
    Ok(hausdorff(a, b)?.mean)
}
