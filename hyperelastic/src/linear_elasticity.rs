//! Linearised elasticity, for comparison.

use crate::dissipation::ViscousDissipation;
use crate::error::LawError;
use crate::hypotheses::{Growth, Hypotheses};
use crate::moduli::LameModuli;
use crate::stored_energy::StoredEnergy;
use fe_grid::{Lane, Tensor};

/// `W = lambda/2 (tr e)^2 + mu |e|^2`, `e = sym h`: the dissipation of a displacement.
///
/// It is quadratic, so all derivatives beyond the second vanish, and finite for every `h`, even if
/// the deformation folds. It is not frame indifferent: a rotation by `t` in a plane has the energy
/// `2 (cos t - 1)^2 (lambda + mu)`, in 2D and in 3D.
#[derive(Clone, Copy, Debug)]
pub struct LinearElasticity<const D: usize> {
    form: ViscousDissipation,
}

impl<const D: usize> LinearElasticity<D> {
    /// Creates the law with these moduli.
    ///
    /// # Errors
    /// [`LawError::Moduli`] if they are not admissible.
    pub fn new(moduli: LameModuli) -> Result<Self, LawError> {
        Ok(Self {
            form: ViscousDissipation {
                moduli: moduli.checked()?,
            },
        })
    }
}

impl<const D: usize> StoredEnergy<D> for LinearElasticity<D> {
    #[inline(always)]
    fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L {
        self.form.rate(h)
    }
    #[inline(always)]
    fn gradient<L: Lane>(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>) {
        (self.form.rate(h), self.form.stress(h))
    }
    #[inline(always)]
    fn hessian_action<L: Lane>(&self, _: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
        self.form.stress(b)
    }
    fn moduli(&self) -> LameModuli {
        self.form.moduli
    }
    fn hypotheses(&self) -> Hypotheses {
        Hypotheses {
            dimension: D,
            frame_indifferent: false,
            isotropic: false,
            stress_free: true,
            // Convex in A alone.
            polyconvex: true,
            barrier: false,
            minimum_on_rotations: false,
            // Skew displacement gradients have zero energy, however large.
            growth: Growth::default(),
        }
    }
    fn name(&self) -> &'static str {
        "linear"
    }
}
