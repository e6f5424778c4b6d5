//! The elastic energy of an object in a soft void, as a law of the cell engine.

use crate::compiled::{CompiledLaw, GradientCall, HessianCall, Place, ValueCall, places_of_faces};
use fe_grid::engine::{Block, BlockFluxes, Evaluated, MAX_CORNERS};
use fe_grid::{CellLaw, Jet, Lane, Point, Reads, mutant, tensor};

/// `kappa W(1 + Du)` for a displacement `u`, with `kappa = (1 - delta) chi + delta` from the nodal
/// indicator `chi` (coefficient 0) and the void stiffness `delta`.
#[derive(Clone, Debug)]
pub struct WeightedElasticity<'a, const D: usize> {
    /// The stored energy density `W`.
    pub law: &'a CompiledLaw<D>,
    /// Stiffness `delta` of the void, relative to the object.
    pub void_stiffness: f64,
}

impl<const D: usize> WeightedElasticity<'_, D> {
    const PLACES: [[Place; D]; MAX_CORNERS] = places_of_faces();

    #[inline(always)]
    fn weight<L: Lane>(&self, indicator: L) -> L {
        let void = mutant!(self.void_stiffness, VoidWeight => 0.0);
        indicator.mul_add(L::splat(1.0 - void), L::splat(void))
    }

    /// Returns the weights at the points of a block.
    #[inline(always)]
    fn weights<L: Lane>(&self, block: &Block<L, D, D>) -> [L; MAX_CORNERS] {
        let mut weights = [L::zero(); MAX_CORNERS];
        for q in 0..1 << D {
            weights[q] = self.weight(block.coefficient(0)[q]);
        }
        weights
    }
}

impl<const D: usize> Reads for WeightedElasticity<'_, D> {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellLaw<D, D> for WeightedElasticity<'_, D> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, D>) -> L {
        self.law.value(&point.gradient) * self.weight(point.coefficient[0])
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let weight = self.weight(point.coefficient[0]);
        let (value, gradient) = self.law.weighted_gradient(&point.gradient, weight);
        let flux = Jet {
            value: [L::zero(); D],
            gradient,
        };
        (value, flux)
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
        Jet {
            value: [L::zero(); D],
            gradient: tensor::scale(&change, weight),
        }
    }

    #[inline(always)]
    fn hessian_actions<L: Lane>(
        &self,
        point: &Point<L, D, D>,
        directions: &[Jet<L, D, D>],
        changes: &mut [Jet<L, D, D>],
    ) {
        let weight = self.weight(point.coefficient[0]);
        self.law
            .hessian_actions(&point.gradient, directions, changes);
        for change in changes {
            change.gradient = tensor::scale(&change.gradient, weight);
        }
    }

    #[inline(always)]
    fn block_value<L: Lane>(&self, block: &Block<L, D, D>) -> L {
        let mut densities = self.weights(block);
        self.law.block_value(ValueCall {
            strains: block.state().gradients(),
            places: &Self::PLACES[..1 << D],
            densities: &mut densities,
        });
        sum_of_points::<L, D>(&densities)
    }

    #[inline(always)]
    fn block_gradient<L: Lane>(
        &self,
        block: &Block<L, D, D>,
        fluxes: &mut BlockFluxes<L, D, D>,
    ) -> L {
        let mut densities = self.weights(block);
        self.law.block_gradient(GradientCall {
            strains: block.state().gradients(),
            places: &Self::PLACES[..1 << D],
            densities: &mut densities,
            stresses: fluxes.gradients_mut(),
        });
        sum_of_points::<L, D>(&densities)
    }

    #[inline(always)]
    fn block_hessian_action<L: Lane>(
        &self,
        block: &Block<L, D, D>,
        direction: &Evaluated<L, D, D>,
        fluxes: &mut BlockFluxes<L, D, D>,
    ) {
        self.law.block_hessian_action(HessianCall {
            strains: block.state().gradients(),
            directions: direction.gradients(),
            places: &Self::PLACES[..1 << D],
            weights: &self.weights(block),
            stresses: fluxes.gradients_mut(),
        });
    }
}

/// Adds the numbers of all points of a cell, in turn.
#[inline(always)]
fn sum_of_points<L: Lane, const D: usize>(numbers: &[L; MAX_CORNERS]) -> L {
    let mut sum = L::zero();
    for q in 0..1 << D {
        sum += numbers[q];
    }
    sum
}
