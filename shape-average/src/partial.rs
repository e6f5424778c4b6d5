//! The functional as a function of two arguments: deformations and average, neither eliminated.

use crate::objective::shape;
use crate::{AverageError, AverageObjective, Energy};
use fe_grid::minimise::Objective;
use fe_grid::{Assembly, Data, vector};

impl<const D: usize> AverageObjective<D> {
    /// All terms at displacements `x` and at [`AverageObjective::average`] as it is, not solved
    /// for anew; the partial derivative of [`Energy::total`] by `x`, without the barrier,
    /// overwrites `gradient` unless that is empty. None where a deformation folds.
    ///
    /// At the average that minimises the functional for `x`, this is also the derivative of the
    /// reduced functional.
    ///
    /// # Errors
    /// Those of the law.
    ///
    /// # Panics
    /// If `x`, or a `gradient` that is not empty, has not the dimension of the objective.
    pub fn at_present_average(
        &self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Option<Energy>, AverageError> {
        assert_eq!(x.len(), self.dim());
        assert!(gradient.is_empty() || gradient.len() == x.len());
        let dim = self.shape_dim();
        let mut gradients = gradient.chunks_exact_mut(dim);
        let mut terms = Vec::with_capacity(self.shapes().n_shapes());
        for i in 0..self.shapes().n_shapes() {
            let gradient = gradients.next().unwrap_or_default();
            let displacement = shape(x, i, dim);
            let Some(of_shape) = self.shape_energy(i, displacement, gradient)? else {
                return Ok(None);
            };
            terms.push(of_shape);
            if !gradient.is_empty() && of_shape.barrier > 0.0 {
                let barrier = self.barrier();
                let barrier = Assembly::new(*self.grid(), &barrier, Data::default());
                let mut slope = vec![0.0; dim];
                barrier.value_and_gradient_into(displacement, &mut slope)?;
                self.hold_boundary(&mut slope);
                vector::axpy(-1.0, &slope, gradient);
            }
        }
        Ok(Some(Energy::new(self.weights(), &terms, self.length()?)))
    }
}
