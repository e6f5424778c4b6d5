//! Linear viscous friction.

use crate::moduli::LameModuli;
use fe_grid::{Lane, Tensor, mutant, tensor};

/// Rate of viscous dissipation of a velocity `v`,
/// `diss[v] = lambda/2 (tr e)^2 + mu tr(e^2)`, `e = sym Dv`.
///
/// The elastic laws are consistent with it: `W_,AA(1)[B] : B = 2 diss[B]` (Lemma 6.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViscousDissipation {
    /// `lambda` and `mu`.
    pub moduli: LameModuli,
}

impl ViscousDissipation {
    /// Returns `diss` of a velocity gradient `Dv`.
    #[inline(always)]
    pub fn rate<L: Lane, const D: usize>(&self, velocity_gradient: &Tensor<L, D>) -> L {
        let strain_rate = tensor::symmetric_part(velocity_gradient);
        let trace = tensor::trace(&strain_rate);
        (trace * trace).mul_add(
            L::splat(mutant!(0.5, ViscousTrace => 1.0) * self.moduli.lambda),
            tensor::contract(&strain_rate, &strain_rate).scale(self.moduli.mu),
        )
    }

    /// Returns the viscous stress `lambda tr(e) 1 + 2 mu e`, the derivative of the rate with
    /// respect to `Dv`.
    #[inline(always)]
    pub fn stress<L: Lane, const D: usize>(
        &self,
        velocity_gradient: &Tensor<L, D>,
    ) -> Tensor<L, D> {
        let strain_rate = tensor::symmetric_part(velocity_gradient);
        let pressure = tensor::trace(&strain_rate).scale(self.moduli.lambda);
        tensor::add_scaled(
            &tensor::diagonal(pressure),
            L::splat(mutant!(2.0, ViscousShear => 1.0) * self.moduli.mu),
            &strain_rate,
        )
    }
}
