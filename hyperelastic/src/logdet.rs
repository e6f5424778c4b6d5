//! The default law.

use crate::error::LawError;
use crate::hypotheses::{Growth, Hypotheses};
use crate::isotropic::Isotropic;
use crate::moduli::LameModuli;
use crate::stored_energy::{PolyconvexForm, StoredEnergy};
use crate::terms::{Absent, LogVolume, SquaredNorm};
use fe_grid::{Lane, Tensor, mutant};

/// `W = mu/2 |A|^2 + lambda/4 D^2 - (mu + lambda/2) ln D - d mu/2 - lambda/4`, `D = det A > 0`.
///
/// `W_,A = mu A + (lambda/2 D^2 - mu - lambda/2) A^-T`,
/// `W_,AA[B] = mu B + lambda D^2 tr(A^-1 B) A^-T - (lambda/2 D^2 - mu - lambda/2) A^-T B^T A^-T`.
///
/// Its moduli are exactly `(lambda, mu)`, and it is polyconvex for all `lambda >= 0`. Its growth
/// (`|A|^2`, and a logarithm under compression) is below that required by the existence theorems.
///
/// # Derivation
/// With `h = A - 1` and `x = D - 1`, the terms of first order cancel analytically:
/// `W = mu/2 |h|^2 - mu (x - tr h) + lambda/4 x^2 + (mu + lambda/2) (x - ln(1 + x))`, where
/// `x - tr h` is of second order in `h`. This expression is evaluated.
///
/// ```
/// use hyperelastic::{LameModuli, LogDet, StoredEnergy};
/// let law = LogDet::<2>::new(LameModuli::new(1.0, 1.0)?)?;
/// let (value, stress) = law.gradient(&[[0.0, 0.0], [0.0, 0.0]]);
/// assert_eq!(value, 0.0);
/// assert_eq!(stress, [[0.0, 0.0], [0.0, 0.0]]);
/// # Ok::<(), hyperelastic::LawError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct LogDet<const D: usize> {
    moduli: LameModuli,
    terms: Isotropic<SquaredNorm, Absent, LogVolume, D>,
}

impl<const D: usize> LogDet<D> {
    /// Creates the law with these moduli.
    ///
    /// # Errors
    /// [`LawError::Moduli`] if they are not admissible.
    pub fn new(moduli: LameModuli) -> Result<Self, LawError> {
        let LameModuli { lambda, mu } = moduli.checked()?;
        Ok(Self {
            moduli,
            terms: Isotropic {
                norm: SquaredNorm { slope: 0.5 * mu },
                cofactor: Absent,
                volume: LogVolume {
                    lambda: mutant!(lambda, LogdetLambda => 1.1 * lambda),
                    mu,
                },
            },
        })
    }
}

impl<const D: usize> StoredEnergy<D> for LogDet<D> {
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
        let growth = Growth {
            norm: 2.0,
            expansion: if self.moduli.lambda > 0.0 { 2.0 } else { 0.0 },
            ..Growth::default()
        };
        Hypotheses::of_polyconvex(D, growth)
    }
    fn name(&self) -> &'static str {
        "logdet"
    }
}

impl<const D: usize> PolyconvexForm<D> for LogDet<D> {
    fn polyconvex_value(
        &self,
        a: &Tensor<f64, D>,
        cofactor: &Tensor<f64, D>,
        determinant: f64,
    ) -> f64 {
        self.terms.polyconvex_value(a, cofactor, determinant)
    }
}
