//! Energies of a strain that is computed from the point data of the cell engine.

use crate::compiled::{CompiledLaw, GradientCall, HessianCall, ValueCall, places_of_points};
use fe_grid::engine::{
    Block, BlockFluxes, BlockGradients, Evaluated, MAX_CORNERS, MAX_FACE_CORNERS,
};
use fe_grid::{CellLaw, Jet, Lane, Point, Reads, Tensor};

/// A density that evaluates a stored energy `W` once, at a strain `h = F - 1` that it computes.
///
/// The operations before and after this are implemented pointwise; [`StrainEnergy`] makes the
/// density a law of the cell engine, which calls the compiled `W` once for several points.
pub trait StrainDensity<const D: usize, const M: usize>: Reads {
    /// Quantities of a point that are computed before `W` is evaluated, and used again afterwards.
    type Kinematics<L: Lane>: Copy;

    /// Returns the stored energy density.
    fn law(&self) -> &CompiledLaw<D>;

    /// Computes the kinematic quantities of a point.
    fn kinematics<L: Lane>(&self, point: &Point<L, D, M>) -> Self::Kinematics<L>;

    /// Returns the strain `h`.
    fn strain<L: Lane>(&self, at: &Self::Kinematics<L>) -> Tensor<L, D>;

    /// Computes the density from `W`.
    fn value<L: Lane>(&self, at: &Self::Kinematics<L>, value: L) -> L;

    /// Returns the weight `w` of `W` and its stress in a gradient; one by default.
    #[inline(always)]
    fn weight<L: Lane>(&self, at: &Self::Kinematics<L>) -> L {
        let _ = at;
        L::one()
    }

    /// Computes the density and its derivative from `w W` and `w W_,A`.
    fn gradient<L: Lane>(
        &self,
        at: &Self::Kinematics<L>,
        value: L,
        stress: &Tensor<L, D>,
    ) -> (L, Jet<L, D, M>);

    /// Computes the change of the strain in a direction.
    fn strain_change<L: Lane>(
        &self,
        at: &Self::Kinematics<L>,
        direction: &Jet<L, D, M>,
    ) -> Tensor<L, D>;

    /// Computes the second derivative applied to a direction, from `W_,AA` applied to the change of
    /// the strain.
    fn hessian_action<L: Lane>(
        &self,
        at: &Self::Kinematics<L>,
        direction: &Jet<L, D, M>,
        stress: &Tensor<L, D>,
    ) -> Jet<L, D, M>;
}

/// A [`StrainDensity`] as a law of the cell engine.
#[derive(Clone, Copy, Debug)]
pub struct StrainEnergy<E>(pub E);

/// Number of points per call of the compiled law.
const POINTS: usize = MAX_FACE_CORNERS;

/// Converts the strains of some points to the layout of the compiled law.
#[inline(always)]
fn gathered<L: Lane, const D: usize>(
    strains: impl Fn(usize) -> Tensor<L, D>,
) -> BlockGradients<L, D, D> {
    let mut block = [[[L::zero(); POINTS]; D]; D];
    for p in 0..POINTS {
        let strain = strains(p);
        for i in 0..D {
            for k in 0..D {
                block[i][k][p] = strain[i][k];
            }
        }
    }
    block
}

/// Returns the tensor of one of these points.
#[inline(always)]
fn tensor_of<L: Lane, const D: usize>(block: &BlockGradients<L, D, D>, p: usize) -> Tensor<L, D> {
    let mut tensor = [[L::zero(); D]; D];
    for i in 0..D {
        for k in 0..D {
            tensor[i][k] = block[i][k][p];
        }
    }
    tensor
}

impl<E> StrainEnergy<E> {
    /// Returns the kinematics of [`POINTS`] points of a block, from the point `first` on.
    ///
    /// Each is written out: the closure of `array::from_fn` would be compiled without the
    /// instruction set of the caller, and every operation of a vector would be a function call.
    #[inline(always)]
    fn kinematics_from<L: Lane, const D: usize, const M: usize>(
        &self,
        block: &Block<L, D, M>,
        first: usize,
    ) -> [E::Kinematics<L>; POINTS]
    where
        E: StrainDensity<D, M>,
    {
        const { assert!(POINTS == 4) };
        [
            self.0.kinematics(&block.point(first)),
            self.0.kinematics(&block.point(first + 1)),
            self.0.kinematics(&block.point(first + 2)),
            self.0.kinematics(&block.point(first + 3)),
        ]
    }
}

impl<E: Reads> Reads for StrainEnergy<E> {
    const USES_VALUE: bool = E::USES_VALUE;
    const USES_GRADIENT: bool = E::USES_GRADIENT;
    const COEFFICIENTS: usize = E::COEFFICIENTS;
    const CELL_DATA: usize = E::CELL_DATA;
    const POINT_OFFSET: f64 = E::POINT_OFFSET;
}

impl<E: StrainDensity<D, M>, const D: usize, const M: usize> CellLaw<D, M> for StrainEnergy<E> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, M>) -> L {
        let at = self.0.kinematics(point);
        self.0.value(&at, self.0.law().value(&self.0.strain(&at)))
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, M>) -> (L, Jet<L, D, M>) {
        let at = self.0.kinematics(point);
        let law = self.0.law();
        let (value, stress) = law.weighted_gradient(&self.0.strain(&at), self.0.weight(&at));
        self.0.gradient(&at, value, &stress)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, M>,
        direction: &Jet<L, D, M>,
    ) -> Jet<L, D, M> {
        let at = self.0.kinematics(point);
        let change = self.0.strain_change(&at, direction);
        let stress = self.0.law().hessian_action(&self.0.strain(&at), &change);
        self.0.hessian_action(&at, direction, &stress)
    }

    #[inline(always)]
    fn block_value<L: Lane>(&self, block: &Block<L, D, M>) -> L {
        let mut sum = L::zero();
        for first in (0..1usize << D).step_by(POINTS) {
            let at = self.kinematics_from(block, first);
            let mut densities = [L::one(); MAX_CORNERS];
            self.0.law().block_value(ValueCall {
                strains: &gathered(|p| self.0.strain(&at[p])),
                places: &places_of_points(),
                densities: &mut densities,
            });
            for p in 0..POINTS {
                sum += self.0.value(&at[p], densities[p]);
            }
        }
        sum
    }

    #[inline(always)]
    fn block_gradient<L: Lane>(
        &self,
        block: &Block<L, D, M>,
        fluxes: &mut BlockFluxes<L, D, M>,
    ) -> L {
        let mut sum = L::zero();
        for first in (0..1usize << D).step_by(POINTS) {
            let at = self.kinematics_from(block, first);
            let mut densities = [L::zero(); MAX_CORNERS];
            for p in 0..POINTS {
                densities[p] = self.0.weight(&at[p]);
            }
            let mut stresses = [[[L::zero(); POINTS]; D]; D];
            self.0.law().block_gradient(GradientCall {
                strains: &gathered(|p| self.0.strain(&at[p])),
                places: &places_of_points(),
                densities: &mut densities,
                stresses: &mut stresses,
            });
            for p in 0..POINTS {
                let (value, flux) = self
                    .0
                    .gradient(&at[p], densities[p], &tensor_of(&stresses, p));
                sum += value;
                fluxes.add::<Self>(first + p, &flux);
            }
        }
        sum
    }

    #[inline(always)]
    fn block_hessian_action<L: Lane>(
        &self,
        block: &Block<L, D, M>,
        direction: &Evaluated<L, D, M>,
        fluxes: &mut BlockFluxes<L, D, M>,
    ) {
        for first in (0..1usize << D).step_by(POINTS) {
            let at = self.kinematics_from(block, first);
            let change = gathered(|p| self.0.strain_change(&at[p], &direction.jet(first + p)));
            let mut stresses = [[[L::zero(); POINTS]; D]; D];
            self.0.law().block_hessian_action(HessianCall {
                strains: &gathered(|p| self.0.strain(&at[p])),
                directions: &change,
                places: &places_of_points(),
                weights: &[L::one(); MAX_CORNERS],
                stresses: &mut stresses,
            });
            for p in 0..POINTS {
                let stress = tensor_of(&stresses, p);
                let flux = self
                    .0
                    .hessian_action(&at[p], &direction.jet(first + p), &stress);
                fluxes.add::<Self>(first + p, &flux);
            }
        }
    }
}
