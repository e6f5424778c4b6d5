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
//! deformations may fold and are controlled by `nu` alone.
//!
//! Source: the relaxed formulation of the lecture notes (Rumpf and Wirth, section 6), written on
//! the start domain.

use crate::cells::ObjectWeights;
use fe_grid::{Jet, Lane, Point, Reads, Tensor, mutant, tensor};
use hyperelastic::{CompiledLaw, StrainDensity};

/// The density of `W_k`, for a [`StrainEnergy`](hyperelastic::StrainEnergy). The unknown has
/// `M = 2 D` components: the displacement of `psi_{k-1}` and that of `psi_k`. Coefficient 0 is the
/// level set of the start shape.
#[derive(Clone, Copy, Debug)]
pub struct PathDissipation<'a, const D: usize> {
    /// The stored energy density `W`.
    pub law: &'a CompiledLaw<D>,
    /// The weights of object and void.
    pub weights: ObjectWeights,
}

/// The two gradients at a point, and the quantities derived from them.
#[derive(Clone, Copy)]
pub struct PathKinematics<L, const D: usize> {
    /// `Dpsi_k - Dpsi_{k-1}`.
    change: Tensor<L, D>,
    /// `(Dpsi_{k-1})^{-T}`.
    inverse_transpose: Tensor<L, D>,
    /// `F - 1`.
    strain: Tensor<L, D>,
    /// `J`.
    volume: L,
    /// Weights of the law and of the viscous part.
    elastic: L,
    viscous: L,
}

impl<L: Lane, const D: usize> PathKinematics<L, D> {
    /// `J`, or NaN if it is not positive.
    #[inline(always)]
    fn oriented(&self) -> L {
        let volume = mutant!(self.volume, StepVolume => L::one());
        L::select(L::zero().less(self.volume), volume, L::splat(f64::NAN))
    }

    /// Whether the law has a positive weight.
    #[inline(always)]
    fn solid(&self) -> L::Mask {
        L::zero().less(self.elastic)
    }

    /// The viscous part of the density.
    #[inline(always)]
    fn quadratic(&self) -> L {
        tensor::contract(&self.change, &self.change) * self.viscous.scale(0.5)
    }
}

impl<const D: usize> Reads for PathDissipation<'_, D> {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize, const M: usize> StrainDensity<D, M> for PathDissipation<'_, D> {
    type Kinematics<L: Lane> = PathKinematics<L, D>;

    #[inline(always)]
    fn law(&self) -> &CompiledLaw<D> {
        self.law
    }

    #[inline(always)]
    fn kinematics<L: Lane>(&self, point: &Point<L, D, M>) -> PathKinematics<L, D> {
        const { assert!(M == 2 * D) };
        let (elastic, viscous) = self.weights.at(point.coefficient[0]);
        let mut before = tensor::zero::<L, D>();
        let mut change = tensor::zero::<L, D>();
        for i in 0..D {
            for k in 0..D {
                before[i][k] = point.gradient[i][k];
                change[i][k] = point.gradient[D + i][k] - point.gradient[i][k];
            }
        }
        let before = tensor::add_identity(&before);
        let cofactor = tensor::cofactor(&before);
        let volume = tensor::determinant_with(&before, &cofactor);
        let inverse_transpose = tensor::scale(&cofactor, L::one() / volume);
        PathKinematics {
            strain: mutant!(
                tensor::product_transposed(&change, &inverse_transpose),
                StepGradient => change
            ),
            change,
            inverse_transpose,
            volume,
            elastic,
            viscous,
        }
    }

    #[inline(always)]
    fn strain<L: Lane>(&self, at: &PathKinematics<L, D>) -> Tensor<L, D> {
        at.strain
    }

    #[inline(always)]
    fn value<L: Lane>(&self, at: &PathKinematics<L, D>, value: L) -> L {
        let value = value * at.oriented() * at.elastic;
        L::select(at.solid(), value, L::zero()) + at.quadratic()
    }

    #[inline(always)]
    fn weight<L: Lane>(&self, at: &PathKinematics<L, D>) -> L {
        at.oriented() * at.elastic
    }

    #[inline(always)]
    fn gradient<L: Lane>(
        &self,
        at: &PathKinematics<L, D>,
        value: L,
        stress: &Tensor<L, D>,
    ) -> (L, Jet<L, D, M>) {
        // W and P = W_,A(F) are multiplied by the weight and J. With G = (Dpsi_{k-1})^{-1}:
        // d/dDpsi_k = P G^T, d/dDpsi_{k-1} = (W 1 - F^T P) G^T.
        let after = tensor::product(stress, &at.inverse_transpose);
        let deformed = tensor::add_identity(&at.strain);
        let mut inner = tensor::scale(&tensor::transposed_product(&deformed, stress), -L::one());
        for i in 0..D {
            inner[i][i] += mutant!(value, StepStress => L::zero());
        }
        let before = tensor::product(&inner, &at.inverse_transpose);
        let mut jet = Jet::zero();
        for i in 0..D {
            for k in 0..D {
                let viscous_stress = at.change[i][k] * at.viscous;
                let (b, a) = (before[i][k], after[i][k]);
                jet.gradient[i][k] = L::select(at.solid(), b, L::zero()) - viscous_stress;
                jet.gradient[D + i][k] = L::select(at.solid(), a, L::zero()) + viscous_stress;
            }
        }
        let density = L::select(at.solid(), value, L::zero()) + at.quadratic();
        (density, jet)
    }

    /// `dF = (dDpsi_k - F dDpsi_{k-1}) G`.
    #[inline(always)]
    fn strain_change<L: Lane>(
        &self,
        at: &PathKinematics<L, D>,
        direction: &Jet<L, D, M>,
    ) -> Tensor<L, D> {
        let deformed = tensor::add_identity(&at.strain);
        let (before, after) = pair(&direction.gradient);
        let difference = tensor::sub(&after, &tensor::product(&deformed, &before));
        tensor::product_transposed(&difference, &at.inverse_transpose)
    }

    /// The Gauss-Newton part `J W_,AA(F)[dF] : dF`.
    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        at: &PathKinematics<L, D>,
        direction: &Jet<L, D, M>,
        stress: &Tensor<L, D>,
    ) -> Jet<L, D, M> {
        let deformed = tensor::add_identity(&at.strain);
        let (before, after) = pair(&direction.gradient);
        let stress = tensor::scale(stress, at.elastic * at.volume);
        let on_after = tensor::product(&stress, &at.inverse_transpose);
        let on_before = tensor::transposed_product(&deformed, &on_after);
        let mut jet = Jet::zero();
        for i in 0..D {
            for k in 0..D {
                let viscous_stress = (after[i][k] - before[i][k]) * at.viscous;
                let (b, a) = (on_before[i][k], on_after[i][k]);
                jet.gradient[i][k] = -(L::select(at.solid(), b, L::zero()) + viscous_stress);
                jet.gradient[D + i][k] = L::select(at.solid(), a, L::zero()) + viscous_stress;
            }
        }
        jet
    }
}

/// Returns the two gradients of a direction.
#[inline(always)]
fn pair<L: Lane, const D: usize, const M: usize>(
    gradient: &[[L; D]; M],
) -> (Tensor<L, D>, Tensor<L, D>) {
    let before = std::array::from_fn(|i| gradient[i]);
    let after = std::array::from_fn(|i| gradient[D + i]);
    (before, after)
}
