//! Energies of a strain that is itself a function of what a law of the cell engine sees.

use crate::compiled::{CompiledLaw, GradientCall, HessianCall, ValueCall, places_of_points};
use fe_grid::engine::{
    Block, BlockFluxes, BlockGradients, Evaluated, MAX_CORNERS, MAX_FACE_CORNERS,
};
use fe_grid::{CellLaw, Jet, Lane, Point, Reads, Tensor};

/// A density that asks a stored energy `W` once, at a strain `h = F - 1` of its own making.
///
/// What stands before and after that is written here, pointwise; [`StrainEnergy`] makes a law of the
/// cell engine of it, which enters the compiled `W` once for several points.
pub trait StrainDensity<const D: usize, const M: usize>: Reads {
    /// What is made of a point before `W` is asked, and used again afterwards.
    type Kinematics<L: Lane>: Copy;

    /// The stored energy density.
    fn law(&self) -> &CompiledLaw<D>;

    /// What is made of a point.
    fn kinematics<L: Lane>(&self, point: &Point<L, D, M>) -> Self::Kinematics<L>;

    /// The strain `h`.
    fn strain<L: Lane>(&self, at: &Self::Kinematics<L>) -> Tensor<L, D>;

    /// The density, from `W`.
    fn value<L: Lane>(&self, at: &Self::Kinematics<L>, value: L) -> L;

    /// The weight `w` with which `W` and its stress are asked for a gradient; one unless said
    /// otherwise.
    #[inline(always)]
    fn weight<L: Lane>(&self, at: &Self::Kinematics<L>) -> L {
        let _ = at;
        L::one()
    }

    /// The density and its derivative, from `w W` and `w W_,A`.
    fn gradient<L: Lane>(
        &self,
        at: &Self::Kinematics<L>,
        value: L,
        stress: &Tensor<L, D>,
    ) -> (L, Jet<L, D, M>);

    /// The change of the strain in a direction.
    fn strain_change<L: Lane>(
        &self,
        at: &Self::Kinematics<L>,
        direction: &Jet<L, D, M>,
    ) -> Tensor<L, D>;

    /// The second derivative applied to a direction, from `W_,AA` applied to the change of the strain.
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

/// Points that the compiled law is asked for at a time.
const POINTS: usize = MAX_FACE_CORNERS;

/// Strains of some points, as the compiled law takes them.
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

/// The tensor of one of these points.
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
            let at: [_; POINTS] =
                std::array::from_fn(|p| self.0.kinematics(&block.point(first + p)));
            let mut values = [L::zero(); MAX_CORNERS];
            self.0.law().block_value(ValueCall {
                strains: &gathered(|p| self.0.strain(&at[p])),
                places: &places_of_points(),
                values: &mut values,
            });
            for p in 0..POINTS {
                sum += self.0.value(&at[p], values[p]);
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
            let at: [_; POINTS] =
                std::array::from_fn(|p| self.0.kinematics(&block.point(first + p)));
            let (mut weights, mut values) = ([L::zero(); MAX_CORNERS], [L::zero(); MAX_CORNERS]);
            for p in 0..POINTS {
                weights[p] = self.0.weight(&at[p]);
            }
            let mut stresses = [[[L::zero(); POINTS]; D]; D];
            self.0.law().block_gradient(GradientCall {
                strains: &gathered(|p| self.0.strain(&at[p])),
                places: &places_of_points(),
                weights: &weights,
                values: &mut values,
                stresses: &mut stresses,
            });
            for p in 0..POINTS {
                let (value, flux) = self.0.gradient(&at[p], values[p], &tensor_of(&stresses, p));
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
            let at: [_; POINTS] =
                std::array::from_fn(|p| self.0.kinematics(&block.point(first + p)));
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
