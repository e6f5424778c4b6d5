//! The elastic energy of an object in a soft void, as a law of the cell engine.

use crate::stored_energy::StoredEnergy;
use fe_grid::{CellLaw, Jet, Lane, Point, Reads};

/// `kappa W(1 + Du)` for a displacement `u`, with `kappa = (1 - delta) chi + delta` from the nodal
/// indicator `chi` (coefficient 0) and the void stiffness `delta`.
#[derive(Clone, Copy, Debug)]
pub struct WeightedElasticity<W> {
    /// The stored energy density `W`.
    pub law: W,
    /// Stiffness `delta` of the void, relative to the object.
    pub void_stiffness: f64,
}

impl<W> WeightedElasticity<W> {
    #[inline(always)]
    fn weight<L: Lane>(&self, indicator: L) -> L {
        indicator.mul_add(
            L::splat(1.0 - self.void_stiffness),
            L::splat(self.void_stiffness),
        )
    }
}

impl<W: Send + Sync> Reads for WeightedElasticity<W> {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<W: StoredEnergy<D>, const D: usize> CellLaw<D, D> for WeightedElasticity<W> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, D>) -> L {
        self.law.value(&point.gradient) * self.weight(point.coefficient[0])
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let weight = self.weight(point.coefficient[0]);
        let (value, gradient) = self.law.weighted_gradient(&point.gradient, weight);
        (
            value,
            Jet {
                value: [L::zero(); D],
                gradient,
            },
        )
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, D>,
        direction: &Jet<L, D, D>,
    ) -> Jet<L, D, D> {
        let weight = self.weight(point.coefficient[0]);
        let change = self
            .law
            .hessian_action(&point.gradient, &direction.gradient);
        let gradient = fe_grid::tensor::scale(&change, weight);
        Jet {
            value: [L::zero(); D],
            gradient,
        }
    }
}
