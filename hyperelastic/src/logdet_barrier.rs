//! The default law with the growth in the determinant required by the theory.

use crate::error::{LawError, require};
use crate::hypotheses::{Growth, Hypotheses};
use crate::isotropic::Isotropic;
use crate::moduli::LameModuli;
use crate::stored_energy::{PolyconvexForm, StoredEnergy};
use crate::terms::{Absent, BarrierVolume, LogVolume, SquaredNorm};
use fe_grid::{Lane, Tensor};

const NAME: &str = "logdet_barrier";

/// [`LogDet`](crate::LogDet) with `lambda_0 = lambda - 2 p b` in place of `lambda`, plus
/// `(b/p) (D^p + D^-p - 2)`, `D = det A > 0`.
///
/// The added term has second derivative `2 p b` at the identity, so the moduli are `(lambda, mu)`
/// as before; the law is polyconvex for `b >= 0`, `p >= 1` and `lambda_0 >= 0`. `W` grows as
/// `D^-p` under compression, not only as a logarithm.
#[derive(Clone, Copy, Debug)]
pub struct LogDetBarrier<const D: usize> {
    moduli: LameModuli,
    terms: Isotropic<SquaredNorm, Absent, BarrierVolume, D>,
}

impl<const D: usize> LogDetBarrier<D> {
    /// The exponent used by [`LogDetBarrier::new`].
    pub const DEFAULT_EXPONENT: f64 = 4.0;

    /// Creates the law with half of `lambda` assigned to the barrier, with exponent
    /// [`Self::DEFAULT_EXPONENT`].
    ///
    /// # Errors
    /// [`LawError::Moduli`] if they are not admissible.
    pub fn new(moduli: LameModuli) -> Result<Self, LawError> {
        let weight = moduli.lambda / (4.0 * Self::DEFAULT_EXPONENT);
        Self::with_barrier(moduli, weight, Self::DEFAULT_EXPONENT)
    }

    /// Creates the law with given weight `b` and exponent `p` of the barrier.
    ///
    /// # Errors
    /// [`LawError::Moduli`] if the moduli are not admissible, [`LawError::Parameter`] unless
    /// `p >= 1` and `0 <= b <= lambda / (2 p)`.
    pub fn with_barrier(moduli: LameModuli, weight: f64, exponent: f64) -> Result<Self, LawError> {
        let LameModuli { lambda, mu } = moduli.checked()?;
        require(exponent >= 1.0, NAME, "exponent", exponent, "at least 1")?;
        let remaining_lambda = lambda - 2.0 * exponent * weight;
        require(
            weight >= 0.0 && remaining_lambda >= 0.0,
            NAME,
            "weight",
            weight,
            "between 0 and lambda / (2 exponent)",
        )?;
        Ok(Self {
            moduli,
            terms: Isotropic {
                norm: SquaredNorm { slope: 0.5 * mu },
                cofactor: Absent,
                volume: BarrierVolume {
                    logarithmic: LogVolume {
                        lambda: remaining_lambda,
                        mu,
                    },
                    weight,
                    exponent,
                },
            },
        })
    }
}

impl<const D: usize> StoredEnergy<D> for LogDetBarrier<D> {
    #[inline(always)]
    fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L {
        self.terms.value(h)
    }
    #[inline(always)]
    fn gradient<L: Lane>(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>) {
        self.weighted_gradient(h, L::one())
    }
    #[inline(always)]
    fn weighted_gradient<L: Lane>(&self, h: &Tensor<L, D>, weight: L) -> (L, Tensor<L, D>) {
        self.terms.weighted_gradient(h, weight)
    }
    #[inline(always)]
    fn hessian_action<L: Lane>(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
        self.terms.hessian_action(h, b)
    }
    fn moduli(&self) -> LameModuli {
        self.moduli
    }
    fn hypotheses(&self) -> Hypotheses {
        let volume = &self.terms.volume;
        let barrier = if volume.weight > 0.0 {
            volume.exponent
        } else {
            0.0
        };
        let square = if volume.logarithmic.lambda > 0.0 {
            2.0
        } else {
            0.0
        };
        let growth = Growth {
            norm: 2.0,
            cofactor: 0.0,
            expansion: barrier.max(square),
            compression: barrier,
        };
        Hypotheses::of_polyconvex(D, growth)
    }
    fn name(&self) -> &'static str {
        NAME
    }
}

impl<const D: usize> PolyconvexForm<D> for LogDetBarrier<D> {
    fn polyconvex_value(
        &self,
        a: &Tensor<f64, D>,
        cofactor: &Tensor<f64, D>,
        determinant: f64,
    ) -> f64 {
        self.terms.polyconvex_value(a, cofactor, determinant)
    }
}
