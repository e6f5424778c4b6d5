//! The dissipation of one step of a path of deformations, as a law of the cell engine.
//!
//! A path is given on its start domain: `psi_0 = id, psi_1, ..., psi_K`. Its `k`-th step is the
//! deformation `phi_k = psi_k o psi_{k-1}^{-1}` of the shape `psi_{k-1}(O_A)`, with the gradient
//! `F = Dpsi_k (Dpsi_{k-1})^{-1}`; pulled back to the start domain its energy is
//!
//! ```text
//! W_k = int ((1 - delta) chi(u_A) + delta) J W(F) + nu (1 - chi(u_A)) |D(psi_k - psi_{k-1})|^2 / 2,
//! J = det Dpsi_{k-1},
//! ```
//!
//! with the smooth indicator `chi` of the start shape, the stiffness `delta` of the void under the
//! same law and its viscosity `nu` without a barrier. Where the weight of the law is zero, the
//! deformations may fold: `nu` alone holds them.
//!
//! Source: the relaxed formulation of the lecture notes (Rumpf and Wirth, section 6), written on the
//! start domain.

use crate::cells::ObjectWeights;
use fe_grid::{CellLaw, Jet, Lane, Point, Reads, Tensor, tensor};
use hyperelastic::StoredEnergy;

/// The density of `W_k`. The unknown has `M = 2 D` components: the displacement of `psi_{k-1}` and
/// that of `psi_k`. Coefficient 0 is the level set of the start shape.
#[derive(Clone, Copy, Debug)]
pub struct PathDissipation<W> {
    /// The stored energy density `W`.
    pub law: W,
    /// The weights of object and void.
    pub weights: ObjectWeights,
}

/// The two gradients at a point, and what is made of them.
struct Kinematics<L, const D: usize> {
    /// `Dpsi_k - Dpsi_{k-1}`.
    change: Tensor<L, D>,
    /// `(Dpsi_{k-1})^{-T}`.
    inverse_transpose: Tensor<L, D>,
    /// `F - 1`.
    strain: Tensor<L, D>,
    /// `J`.
    volume: L,
}

impl<W> PathDissipation<W> {
    #[inline(always)]
    fn kinematics<L: Lane, const D: usize, const M: usize>(
        gradient: &[[L; D]; M],
    ) -> Kinematics<L, D> {
        const { assert!(M == 2 * D) };
        let mut before = tensor::zero::<L, D>();
        let mut change = tensor::zero::<L, D>();
        for i in 0..D {
            for k in 0..D {
                before[i][k] = gradient[i][k];
                change[i][k] = gradient[D + i][k] - gradient[i][k];
            }
        }
        let before = tensor::add_identity(&before);
        let cofactor = tensor::cofactor(&before);
        let volume = tensor::determinant_with(&before, &cofactor);
        let inverse_transpose = tensor::scale(&cofactor, L::one() / volume);
        Kinematics {
            strain: tensor::product_transposed(&change, &inverse_transpose),
            change,
            inverse_transpose,
            volume,
        }
    }
}

impl<W: Send + Sync> Reads for PathDissipation<W> {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<W: StoredEnergy<D>, const D: usize, const M: usize> CellLaw<D, M> for PathDissipation<W> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, M>) -> L {
        let (elastic, viscous) = self.weights.at(point.coefficient[0]);
        let at = Self::kinematics::<L, D, M>(&point.gradient);
        let oriented = L::select(L::zero().less(at.volume), at.volume, L::splat(f64::NAN));
        let value = self.law.value(&at.strain) * oriented * elastic;
        let quadratic = tensor::contract(&at.change, &at.change) * viscous.scale(0.5);
        L::select(L::zero().less(elastic), value, L::zero()) + quadratic
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, M>) -> (L, Jet<L, D, M>) {
        let (elastic, viscous) = self.weights.at(point.coefficient[0]);
        let at = Self::kinematics::<L, D, M>(&point.gradient);
        let oriented = L::select(L::zero().less(at.volume), at.volume, L::splat(f64::NAN));
        let solid = L::zero().less(elastic);
        // W and P = W_,A(F), times the weight and J.
        let (value, stress) = self.law.weighted_gradient(&at.strain, oriented * elastic);
        // With G = (Dpsi_{k-1})^{-1}: d/dDpsi_k = P G^T, d/dDpsi_{k-1} = (W 1 - F^T P) G^T.
        let after = tensor::product(&stress, &at.inverse_transpose);
        let deformed = tensor::add_identity(&at.strain);
        let mut inner = tensor::scale(&tensor::transposed_product(&deformed, &stress), -L::one());
        for i in 0..D {
            inner[i][i] += value;
        }
        let before = tensor::product(&inner, &at.inverse_transpose);
        let mut jet = Jet::zero();
        for i in 0..D {
            for k in 0..D {
                let viscous_stress = at.change[i][k] * viscous;
                let (b, a) = (before[i][k], after[i][k]);
                jet.gradient[i][k] = L::select(solid, b, L::zero()) - viscous_stress;
                jet.gradient[D + i][k] = L::select(solid, a, L::zero()) + viscous_stress;
            }
        }
        let quadratic = tensor::contract(&at.change, &at.change) * viscous.scale(0.5);
        (L::select(solid, value, L::zero()) + quadratic, jet)
    }

    /// The part of Gauss and Newton, `J W_,AA(F)[dF] : dF` with
    /// `dF = (dDpsi_k - F dDpsi_{k-1}) G`.
    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, M>,
        direction: &Jet<L, D, M>,
    ) -> Jet<L, D, M> {
        let (elastic, viscous) = self.weights.at(point.coefficient[0]);
        let at = Self::kinematics::<L, D, M>(&point.gradient);
        let deformed = tensor::add_identity(&at.strain);
        let (mut before, mut after) = (tensor::zero::<L, D>(), tensor::zero::<L, D>());
        for i in 0..D {
            for k in 0..D {
                before[i][k] = direction.gradient[i][k];
                after[i][k] = direction.gradient[D + i][k];
            }
        }
        let difference = tensor::sub(&after, &tensor::product(&deformed, &before));
        let change = tensor::product_transposed(&difference, &at.inverse_transpose);
        let stress = self.law.hessian_action(&at.strain, &change);
        let stress = tensor::scale(&stress, elastic * at.volume);
        let on_after = tensor::product(&stress, &at.inverse_transpose);
        let on_before = tensor::transposed_product(&deformed, &on_after);
        let solid = L::zero().less(elastic);
        let mut jet = Jet::zero();
        for i in 0..D {
            for k in 0..D {
                let viscous_stress = (after[i][k] - before[i][k]) * viscous;
                let (b, a) = (on_before[i][k], on_after[i][k]);
                jet.gradient[i][k] = -(L::select(solid, b, L::zero()) + viscous_stress);
                jet.gradient[D + i][k] = L::select(solid, a, L::zero()) + viscous_stress;
            }
        }
        jet
    }
}
