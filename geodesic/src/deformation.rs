//! The deformation energy of one step between two level sets, as a law of the cell engine.
//!
//! ```text
//! W = int ((1 - delta) chi(u) + delta) W(Dphi) + nu (1 - chi(u)) |Dphi - 1|^2 / 2
//! ```
//!
//! for a deformation `phi` of the shape `{u > 0}`, both unknown. Where the weight of the law is
//! zero, the deformation may fold and is controlled by `nu` alone.
//!
//! Source: the lecture notes of Rumpf and Wirth, section 6, `E_deform`.

use crate::cells::ObjectWeights;
use fe_grid::{Jet, Lane, Point, Reads, Tensor, tensor};
use hyperelastic::{CompiledLaw, StrainDensity};

/// The density of the deformation energy, for a [`StrainEnergy`](hyperelastic::StrainEnergy). The
/// unknown has `M = 1 + D` components: the level set `u` and the displacement of `phi`.
#[derive(Clone, Copy, Debug)]
pub struct StepDeformation<'a, const D: usize> {
    /// The stored energy density `W`.
    pub law: &'a CompiledLaw<D>,
    /// The weights of object and void.
    pub weights: ObjectWeights,
}

/// Strain and weights of a point.
#[derive(Clone, Copy)]
pub struct StepKinematics<L, const D: usize> {
    /// `Dphi - 1`.
    strain: Tensor<L, D>,
    /// The level set.
    level_set: L,
    /// Weights of the law and of the viscous part.
    elastic: L,
    viscous: L,
}

impl<L: Lane, const D: usize> StepKinematics<L, D> {
    /// Whether the law has a positive weight.
    #[inline(always)]
    fn solid(&self) -> L::Mask {
        L::zero().less(self.elastic)
    }
}

/// Returns the displacement gradient from the gradients of level set and displacement.
#[inline(always)]
fn displacement_gradient<L: Lane, const D: usize, const M: usize>(
    gradient: &[[L; D]; M],
) -> Tensor<L, D> {
    const { assert!(M == D + 1) };
    std::array::from_fn(|i| gradient[i + 1])
}

impl<const D: usize> Reads for StepDeformation<'_, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

impl<const D: usize, const M: usize> StrainDensity<D, M> for StepDeformation<'_, D> {
    type Kinematics<L: Lane> = StepKinematics<L, D>;

    #[inline(always)]
    fn law(&self) -> &CompiledLaw<D> {
        self.law
    }

    #[inline(always)]
    fn kinematics<L: Lane>(&self, point: &Point<L, D, M>) -> StepKinematics<L, D> {
        let (elastic, viscous) = self.weights.at(point.value[0]);
        StepKinematics {
            strain: displacement_gradient(&point.gradient),
            level_set: point.value[0],
            elastic,
            viscous,
        }
    }

    #[inline(always)]
    fn strain<L: Lane>(&self, at: &StepKinematics<L, D>) -> Tensor<L, D> {
        at.strain
    }

    #[inline(always)]
    fn value<L: Lane>(&self, at: &StepKinematics<L, D>, value: L) -> L {
        let quadratic = tensor::contract(&at.strain, &at.strain) * at.viscous.scale(0.5);
        L::select(at.solid(), value * at.elastic, L::zero()) + quadratic
    }

    #[inline(always)]
    fn gradient<L: Lane>(
        &self,
        at: &StepKinematics<L, D>,
        value: L,
        stress: &Tensor<L, D>,
    ) -> (L, Jet<L, D, M>) {
        let value = L::select(at.solid(), value, L::zero());
        let half_square = tensor::contract(&at.strain, &at.strain).scale(0.5);
        let slope = self.weights.indicator.derivative(at.level_set);
        let mut jet = Jet::zero();
        let by_chi = value.scale(1.0 - self.weights.void_stiffness)
            - half_square.scale(self.weights.void_viscosity);
        jet.value[0] = slope * by_chi;
        for i in 0..D {
            for k in 0..D {
                let stress = L::select(at.solid(), stress[i][k] * at.elastic, L::zero());
                jet.gradient[i + 1][k] = at.strain[i][k].mul_add(at.viscous, stress);
            }
        }
        (value.mul_add(at.elastic, half_square * at.viscous), jet)
    }

    #[inline(always)]
    fn strain_change<L: Lane>(
        &self,
        _at: &StepKinematics<L, D>,
        direction: &Jet<L, D, M>,
    ) -> Tensor<L, D> {
        displacement_gradient(&direction.gradient)
    }

    /// Second derivative with respect to the deformation alone.
    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        at: &StepKinematics<L, D>,
        direction: &Jet<L, D, M>,
        stress: &Tensor<L, D>,
    ) -> Jet<L, D, M> {
        let d = displacement_gradient(&direction.gradient);
        let mut jet = Jet::zero();
        for i in 0..D {
            for k in 0..D {
                let stress = L::select(at.solid(), stress[i][k] * at.elastic, L::zero());
                jet.gradient[i + 1][k] = d[i][k].mul_add(at.viscous, stress);
            }
        }
        jet
    }
}
