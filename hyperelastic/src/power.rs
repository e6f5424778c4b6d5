//! Powers of the norms of `A` and `cof A`, with two choices of the volume term.

use crate::error::{LawError, require};
use crate::hypotheses::{Growth, Hypotheses};
use crate::isotropic::Isotropic;
use crate::moduli::LameModuli;
use crate::power_share::{ShareProblem, choose_share};
use crate::stored_energy::{PolyconvexForm, StoredEnergy};
use crate::terms::{PowerNorm, PowerVolume};
use fe_grid::{Lane, Tensor, mutant};
use serde::{Deserialize, Serialize};

const NAME: &str = "power";
const NAME_TWO_TERM: &str = "power_two_term";

/// Exponents of a [`Power`] law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PowerExponents {
    /// `p >= 2` of `|A|`.
    pub norm: f64,
    /// `q >= 2` of `|cof A|`.
    pub cofactor: f64,
    /// `r >= 1` of `D = det A`.
    pub expansion: f64,
    /// `s > 0` of `1 / D`.
    pub compression: f64,
}

impl Default for PowerExponents {
    /// `p = q = 4`, `r = 2`, `s = 9`: small exponents admitted by Theorem 4.7, which requires
    /// `s > 2 q / (q - 3) = 8`.
    fn default() -> Self {
        Self {
            norm: 4.0,
            cofactor: 4.0,
            expansion: 2.0,
            compression: 9.0,
        }
    }
}

/// Coefficients of the three terms of a [`Power`] law with a two-term volume function.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PowerCoefficients {
    /// `a1 >= 0` of `|A|^p`.
    pub norm: f64,
    /// `a2 >= 0` of `|cof A|^q`.
    pub cofactor: f64,
    /// `a3 > 0` of `D^-s`.
    pub compression: f64,
}

/// `W = a1 |A|^p + a2 |cof A|^q + Gamma(D) - const`, `D = det A > 0`, with `W(1) = 0`,
/// `W_,A(1) = 0`.
///
/// Let `P = a1 p d^(p/2-1)`, `Q = a2 q d^(q/2-1)`, `M = P + (d-1) Q`. The identity is stress free
/// if `Gamma'(1) = -M`, and then the moduli are `mu = P + Q` and
/// `lambda = P (p-2)/d + Q ((q-2)(d-1)^2/d + 2 (d-2)) - M + Gamma''(1)`.
///
/// Two volume functions:
/// * [`Power::null_lagrangian`], `Gamma = a3 D^-s + b D^r - e D`. The linear term is a null
///   Lagrangian: it changes neither the equations nor convexity, and decouples `Gamma''(1)` from
///   `Gamma'(1)`, so that every `lambda, mu > 0` is reached.
/// * [`Power::two_term`], `Gamma = a3 (D^-s + beta D^r)`, the form of the lecture notes, with
///   `beta = (s - M/a3) / r`; polyconvex only where `beta >= 0`, which bounds `lambda` from below.
///
/// With these constructors, both are polyconvex with their minimum exactly on the rotations.
///
/// # Why the minimum is on the rotations
/// By the inequality of arithmetic and geometric means `|A|^2 >= d D^(2/d)` and
/// `|cof A|^2 >= d D^(2(d-1)/d)`, with equality for conformal `A` only, so `W(A) >= w(D)`, a
/// function with `w(1) = w'(1) = 0`. For the two-term form `w` is a convex function of `ln D`; with
/// the linear term it is a convex function of `D` if `p >= d` and `q (d-1) >= d`, which the
/// constructor requires.
#[derive(Clone, Copy, Debug)]
pub struct Power<const D: usize> {
    name: &'static str,
    exponents: PowerExponents,
    terms: Isotropic<PowerNorm, PowerNorm, PowerVolume, D>,
}

impl<const D: usize> Power<D> {
    /// Creates the law for any `lambda, mu > 0`: [`Power::null_lagrangian`] with the default
    /// exponents and an admissible share.
    ///
    /// # Errors
    /// [`LawError::Moduli`] if the moduli are not admissible, [`LawError::LambdaBelowBound`] for
    /// `lambda = 0` in 2D.
    pub fn new(moduli: LameModuli) -> Result<Self, LawError> {
        Self::null_lagrangian(moduli, PowerExponents::default(), None)
    }

    /// Creates the law with volume function `a3 D^-s + b D^r - e D`.
    ///
    /// `norm_share` is the fraction `t` of the shear modulus due to `|A|^p`, `P = t mu`,
    /// `Q = (1-t) mu`. It must leave `Gamma''(1) > 0`; by default the middle of the admissible
    /// shares is used. `Gamma''(1)` is split evenly between its two powers.
    ///
    /// # Errors
    /// [`LawError::Moduli`]; [`LawError::Parameter`] for exponents or a share out of range;
    /// [`LawError::LambdaBelowBound`] if `Gamma''(1) <= 0`, for the given share or for all shares.
    pub fn null_lagrangian(
        moduli: LameModuli,
        exponents: PowerExponents,
        norm_share: Option<f64>,
    ) -> Result<Self, LawError> {
        exponents.check(NAME)?;
        let d = D as f64;
        let PowerExponents {
            norm: p,
            cofactor: q,
            expansion: r,
            compression: s,
        } = exponents;
        require(p >= d, NAME, "p", p, "at least the dimension")?;
        let enough = q * (d - 1.0) >= d;
        require(enough, NAME, "q", q, "at least d / (d - 1)")?;
        require(r > 1.0, NAME, "r", r, "greater than 1")?;
        let (at_norm, at_cofactor) = norm_stiffness::<D>(&exponents);
        let problem = ShareProblem {
            law: NAME,
            moduli: moduli.checked()?,
            bound_at_norm: at_norm - 1.0,
            bound_at_cofactor: at_cofactor - (d - 1.0),
            attained: false,
        };
        let share = choose_share(&problem, norm_share)?;
        let curvature = moduli.lambda - problem.bound(share);
        let mut law = Self::with_shares(NAME, moduli.mu, share, exponents);
        law.terms.volume.compression = 0.5 * curvature / (s * (s + 1.0));
        let share = mutant!(0.5, PowerExpansion => 0.25);
        law.terms.volume.expansion = share * curvature / (r * (r - 1.0));
        Ok(law)
    }

    /// Creates the law with volume function `a3 (D^-s + beta D^r)`.
    ///
    /// `norm_share` is the fraction `t` of the shear modulus due to `|A|^p`; by default the middle
    /// of the admissible shares is used. A share is admissible if
    /// `lambda >= P (p-2)/d + 2 (d-2) Q + Q (q-2) (d-1)^2/d + s (P + (d-1) Q)`, that is
    /// `beta >= 0`.
    ///
    /// # Errors
    /// [`LawError::Moduli`]; [`LawError::Parameter`] for exponents or a share out of range;
    /// [`LawError::LambdaBelowBound`] with the bound if `beta` would be negative.
    pub fn two_term(
        moduli: LameModuli,
        exponents: PowerExponents,
        norm_share: Option<f64>,
    ) -> Result<Self, LawError> {
        exponents.check(NAME_TWO_TERM)?;
        let d = D as f64;
        let (r, s) = (exponents.expansion, exponents.compression);
        let (at_norm, at_cofactor) = norm_stiffness::<D>(&exponents);
        let problem = ShareProblem {
            law: NAME_TWO_TERM,
            moduli: moduli.checked()?,
            bound_at_norm: at_norm + s,
            bound_at_cofactor: at_cofactor + s * (d - 1.0),
            attained: true,
        };
        let share = choose_share(&problem, norm_share)?;
        let mut law = Self::with_shares(NAME_TWO_TERM, moduli.mu, share, exponents);
        let slope = -law.terms.volume.slope;
        let compression = (moduli.lambda - problem.bound(share) + (r + s) * slope) / (s * (s + r));
        law.set_two_terms(compression);
        // Rounding must not make the law at the bound itself non-polyconvex.
        law.terms.volume.expansion = law.terms.volume.expansion.max(0.0);
        Ok(law)
    }

    /// Creates the two-term law with given coefficients; its moduli follow from them.
    ///
    /// `beta` may be negative: the law is then stress free but not polyconvex, as reported by
    /// [`StoredEnergy::hypotheses`].
    ///
    /// # Errors
    /// [`LawError::Parameter`] for exponents out of range, negative `a1`, `a2`, both zero, or
    /// `a3` not positive.
    pub fn from_coefficients(
        coefficients: PowerCoefficients,
        exponents: PowerExponents,
    ) -> Result<Self, LawError> {
        exponents.check(NAME_TWO_TERM)?;
        let PowerCoefficients {
            norm: a1,
            cofactor: a2,
            compression: a3,
        } = coefficients;
        require(a1 >= 0.0, NAME_TWO_TERM, "a1", a1, "not negative")?;
        require(a2 >= 0.0, NAME_TWO_TERM, "a2", a2, "not negative")?;
        require(a1 + a2 > 0.0, NAME_TWO_TERM, "a1 + a2", a1 + a2, "positive")?;
        require(a3 > 0.0, NAME_TWO_TERM, "a3", a3, "positive")?;
        let mut law = Self::with_norms(NAME_TWO_TERM, a1, a2, exponents);
        law.set_two_terms(a3);
        Ok(law)
    }

    /// Creates the norm terms with `P = t mu`, `Q = (1-t) mu`, without volume powers.
    fn with_shares(
        name: &'static str,
        mu: f64,
        norm_share: f64,
        exponents: PowerExponents,
    ) -> Self {
        let d = D as f64;
        let coefficient =
            |share: f64, exponent: f64| share * mu / (exponent * d.powf(0.5 * exponent - 1.0));
        let a1 = coefficient(norm_share, exponents.norm);
        let a2 = coefficient(1.0 - norm_share, exponents.cofactor);
        Self::with_norms(name, a1, a2, exponents)
    }

    fn with_norms(name: &'static str, a1: f64, a2: f64, exponents: PowerExponents) -> Self {
        use crate::terms::NormTerm;
        let norm = PowerNorm::new(a1, exponents.norm, D);
        let cofactor = PowerNorm::new(a2, exponents.cofactor, D);
        let slope = -2.0 * (norm.slope() + (D as f64 - 1.0) * cofactor.slope());
        Self {
            name,
            exponents,
            terms: Isotropic {
                norm,
                cofactor,
                volume: PowerVolume {
                    slope,
                    compression: 0.0,
                    compression_exponent: exponents.compression,
                    expansion: 0.0,
                    expansion_exponent: exponents.expansion,
                },
            },
        }
    }

    /// Sets `a3 (D^-s + beta D^r)` with the slope that makes the identity stress free.
    fn set_two_terms(&mut self, a3: f64) {
        let volume = &mut self.terms.volume;
        volume.compression = a3;
        volume.expansion =
            (volume.compression_exponent * a3 + volume.slope) / volume.expansion_exponent;
    }

    /// Returns the least `a3` with which the law of two terms is polyconvex: `beta` is zero.
    pub(crate) fn least_compression(&self) -> f64 {
        -self.terms.volume.slope / self.terms.volume.compression_exponent
    }

    /// Returns the factor of `D^r`: `b`, or `a3 beta`.
    pub fn expansion_coefficient(&self) -> f64 {
        self.terms.volume.expansion
    }

    /// Returns the factor `a3` of `D^-s`.
    pub fn compression_coefficient(&self) -> f64 {
        self.terms.volume.compression
    }
}

impl PowerExponents {
    fn check(&self, law: &'static str) -> Result<(), LawError> {
        let Self {
            norm,
            cofactor,
            expansion,
            compression,
        } = *self;
        require(norm >= 2.0, law, "p", norm, "at least 2")?;
        require(cofactor >= 2.0, law, "q", cofactor, "at least 2")?;
        require(expansion >= 1.0, law, "r", expansion, "at least 1")?;
        require(compression > 0.0, law, "s", compression, "positive")
    }
}

/// Returns the contributions of the norm terms to `lambda / mu`, without the volume term: `(p-2)/d`
/// per unit of `P / mu`, and `(q-2)(d-1)^2/d + 2(d-2)` per unit of `Q / mu`.
fn norm_stiffness<const D: usize>(exponents: &PowerExponents) -> (f64, f64) {
    let d = D as f64;
    (
        (exponents.norm - 2.0) / d,
        (exponents.cofactor - 2.0) * (d - 1.0).powi(2) / d + 2.0 * (d - 2.0),
    )
}

impl<const D: usize> StoredEnergy<D> for Power<D> {
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
        self.terms.moduli()
    }
    fn hypotheses(&self) -> Hypotheses {
        use crate::terms::NormTerm;
        let when = |present: bool, exponent: f64| if present { exponent } else { 0.0 };
        let convex = self.expansion_coefficient() >= 0.0;
        let growth = Growth {
            norm: when(self.terms.norm.present(), self.exponents.norm),
            cofactor: when(self.terms.cofactor.present(), self.exponents.cofactor),
            expansion: when(self.expansion_coefficient() > 0.0, self.exponents.expansion),
            compression: self.exponents.compression,
        };
        Hypotheses {
            polyconvex: convex,
            minimum_on_rotations: convex,
            growth: if convex {
                growth.completed(D)
            } else {
                Growth::default()
            },
            ..Hypotheses::of_polyconvex(D, growth)
        }
    }
    fn name(&self) -> &'static str {
        self.name
    }
}

impl<const D: usize> PolyconvexForm<D> for Power<D> {
    fn polyconvex_value(
        &self,
        a: &Tensor<f64, D>,
        cofactor: &Tensor<f64, D>,
        determinant: f64,
    ) -> f64 {
        self.terms.polyconvex_value(a, cofactor, determinant)
    }
}
