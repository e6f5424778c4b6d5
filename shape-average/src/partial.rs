//! The functional as a function of two arguments: deformations and average, neither eliminated.

use crate::objective::shape;
use crate::{AverageError, AverageObjective, Energy};
use fe_grid::minimise::Objective;

impl<const D: usize> AverageObjective<D> {
    /// All terms at displacements `x` and at [`AverageObjective::average`] as it is, not solved
    /// for anew; the partial derivative by `x` overwrites `gradient` unless that is empty. None
    /// where a deformation folds.
    ///
    /// At the average that minimises the functional for `x`, this derivative is that of the
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
        let mut energy = Energy {
            length: self.length()?,
            ..Energy::default()
        };
        energy.total = self.params().resolved_length_weight() * energy.length;
        let mut gradients = gradient.chunks_exact_mut(dim);
        for i in 0..self.shapes().n_shapes() {
            let gradient = gradients.next().unwrap_or_default();
            let Some(terms) = self.shape_energy(i, shape(x, i, dim), gradient)? else {
                return Ok(None);
            };
            energy.total += self.weigh(i, terms);
            energy.elastic.push(terms.0);
            energy.mismatch.push(terms.1);
        }
        Ok(Some(energy))
    }
}
