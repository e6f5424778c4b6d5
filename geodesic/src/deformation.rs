//! The deformation energy of one step between two level sets, as a law of the cell engine.
//!
//! ```text
//! W = int ((1 - delta) chi(u) + delta) W(Dphi) + nu (1 - chi(u)) |Dphi - 1|^2 / 2
//! ```
//!
//! for a deformation `phi` of the shape `{u > 0}`, both unknown. Where the weight of the law is
//! zero, the deformation may fold: `nu` alone holds it.
//!
//! Source: the lecture notes of Rumpf and Wirth, section 6, `E_deform`.

use crate::cells::ObjectWeights;
use fe_grid::{CellLaw, Jet, Lane, Point, Reads, Tensor, tensor};
use hyperelastic::StoredEnergy;

/// The density of the deformation energy. The unknown has `M = 1 + D` components: the level set
/// `u` and the displacement of `phi`.
#[derive(Clone, Copy, Debug)]
pub struct StepDeformation<W> {
    /// The stored energy density `W`.
    pub law: W,
    /// The weights of object and void.
    pub weights: ObjectWeights,
}

/// The displacement gradient among the gradients of level set and displacement.
#[inline(always)]
fn displacement_gradient<L: Lane, const D: usize, const M: usize>(
    gradient: &[[L; D]; M],
) -> Tensor<L, D> {
    const { assert!(M == D + 1) };
    std::array::from_fn(|i| gradient[i + 1])
}

impl<W: Send + Sync> Reads for StepDeformation<W> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

impl<W: StoredEnergy<D>, const D: usize, const M: usize> CellLaw<D, M> for StepDeformation<W> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, M>) -> L {
        let (elastic, viscous) = self.weights.at(point.value[0]);
        let h = displacement_gradient(&point.gradient);
        let value = self.law.value(&h) * elastic;
        let quadratic = tensor::contract(&h, &h) * viscous.scale(0.5);
        L::select(L::zero().less(elastic), value, L::zero()) + quadratic
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, M>) -> (L, Jet<L, D, M>) {
        let (elastic, viscous) = self.weights.at(point.value[0]);
        let h = displacement_gradient(&point.gradient);
        let solid = L::zero().less(elastic);
        let (value, stress) = self.law.gradient(&h);
        let value = L::select(solid, value, L::zero());
        let half_square = tensor::contract(&h, &h).scale(0.5);
        let slope = self.weights.indicator.derivative(point.value[0]);
        let mut jet = Jet::zero();
        let by_chi = value.scale(1.0 - self.weights.void_stiffness)
            - half_square.scale(self.weights.void_viscosity);
        jet.value[0] = slope * by_chi;
        for i in 0..D {
            for k in 0..D {
                let stress = L::select(solid, stress[i][k] * elastic, L::zero());
                jet.gradient[i + 1][k] = h[i][k].mul_add(viscous, stress);
            }
        }
        (value.mul_add(elastic, half_square * viscous), jet)
    }

    /// The second derivative by the deformation alone.
    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, M>,
        direction: &Jet<L, D, M>,
    ) -> Jet<L, D, M> {
        let (elastic, viscous) = self.weights.at(point.value[0]);
        let h = displacement_gradient(&point.gradient);
        let d = displacement_gradient(&direction.gradient);
        let change = self.law.hessian_action(&h, &d);
        let solid = L::zero().less(elastic);
        let mut jet = Jet::zero();
        for i in 0..D {
            for k in 0..D {
                let stress = L::select(solid, change[i][k] * elastic, L::zero());
                jet.gradient[i + 1][k] = d[i][k].mul_add(viscous, stress);
            }
        }
        jet
    }
}
