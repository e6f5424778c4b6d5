//! The functional as a function of two arguments, deformations and average, with neither
//! eliminated.

use crate::energy::Energy;
use crate::error::AverageError;
use crate::level::shape;
use crate::objective::AverageObjective;
use fe_grid::compiled_once;
use fe_grid::minimise::Objective;

compiled_once! {
    fn energy_at_present_average<'a, D>(
        objective: &'a AverageObjective<D>,
        x: &'a [f64],
        gradient: &'a mut [f64],
    ) -> Result<Option<Energy>, AverageError> = AverageObjective::at_present_average_in;
}

impl<const D: usize> AverageObjective<D> {
    /// Evaluates the functional at displacements `x` and at the present
    /// [`AverageObjective::average`], which is not recomputed, without the barrier; the partial
    /// derivative with respect to `x` overwrites `gradient` unless that is empty. Returns `None` if
    /// a deformation folds.
    ///
    /// At the average that minimises the functional for `x`, this is also the derivative of the
    /// reduced functional.
    ///
    /// # Errors
    /// Those of the law.
    ///
    /// # Panics
    /// If `x`, or a nonempty `gradient`, does not have the dimension of the objective.
    pub fn at_present_average(
        &self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Option<Energy>, AverageError> {
        energy_at_present_average(self, x, gradient)
    }

    fn at_present_average_in(
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
            // With an infinite smallest corner the barrier is zero.
            let found = self.shape_energy(i, shape(x, i, dim), f64::INFINITY, gradient)?;
            let Some(of_shape) = found else {
                return Ok(None);
            };
            terms.push(of_shape);
        }
        Ok(Some(Energy::new(self.weights(), &terms, &self.lengths())))
    }
}
