//! What may be chosen of a power law beside its moduli.

use crate::error::LawError;
use crate::moduli::LameModuli;
use crate::power::{Power, PowerCoefficients, PowerExponents};
use std::str::FromStr;

/// Exponents, and either the share of a norm term or all coefficients, of the laws `power` and
/// `power_two_term`.
///
/// Without coefficients the law has the moduli of the [`LawSpec`](crate::LawSpec). With coefficients its
/// moduli follow from them and the dimension: [`LawSpec::resolved`](crate::LawSpec::resolved).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct PowerOptions {
    /// Exponents p of |A|, q of |cof A|, r of det A and s of 1/det A in a power law, such as 4,4,2,9.
    #[cfg_attr(feature = "clap", arg(long, value_name = "P,Q,R,S"))]
    pub exponents: Option<PowerExponents>,
    /// Share of the |A|^p term in the shear modulus of a power law, from 0 to 1; the rest is that of
    /// |cof A|^q.
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE"))]
    pub norm_share: Option<f64>,
    /// Coefficients a1 of |A|^p, a2 of |cof A|^q and a3 of (det A)^-s in the law power_two_term, such as
    /// 0.1,0.1,0.2; lambda and mu follow from them.
    #[cfg_attr(feature = "clap", arg(long, value_name = "A1,A2,A3"))]
    pub coefficients: Option<PowerCoefficients>,
}

impl PowerOptions {
    /// The name of an option that is set, as on the command line.
    pub(crate) fn first_set(&self) -> Option<&'static str> {
        let set = [
            ("exponents", self.exponents.is_some()),
            ("norm_share", self.norm_share.is_some()),
            ("coefficients", self.coefficients.is_some()),
        ];
        set.into_iter().find(|(_, set)| *set).map(|(name, _)| name)
    }

    /// The law `power` with these moduli.
    ///
    /// # Errors
    /// As [`Power::null_lagrangian`], and [`LawError::Option`] for coefficients.
    pub(crate) fn null_lagrangian<const D: usize>(
        &self,
        moduli: LameModuli,
    ) -> Result<Power<D>, LawError> {
        if self.coefficients.is_some() {
            return Err(LawError::Option {
                option: "coefficients",
                law: "power".into(),
            });
        }
        let exponents = self.exponents.unwrap_or_default();
        Power::null_lagrangian(moduli, exponents, self.norm_share)
    }

    /// The law `power_two_term` with these moduli.
    ///
    /// # Errors
    /// As [`Power::two_term`] and [`Power::from_coefficients`]; [`LawError::ModuliDiffer`] where the
    /// coefficients belong to other moduli, and [`LawError::Parameter`] for coefficients with a share.
    pub(crate) fn two_term<const D: usize>(
        &self,
        moduli: LameModuli,
    ) -> Result<Power<D>, LawError> {
        let Some((law, found)) = self.of_coefficients::<D>()? else {
            return Power::two_term(moduli, self.exponents_of_two_terms::<D>(), self.norm_share);
        };
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (a.abs() + b.abs());
        if close(moduli.lambda, found.lambda) && close(moduli.mu, found.mu) {
            Ok(law)
        } else {
            Err(LawError::ModuliDiffer {
                lambda: found.lambda,
                mu: found.mu,
            })
        }
    }

    /// The law of the coefficients, if they are set, with its moduli. One that is not polyconvex is refused.
    pub(crate) fn of_coefficients<const D: usize>(
        &self,
    ) -> Result<Option<(Power<D>, LameModuli)>, LawError> {
        use crate::stored_energy::StoredEnergy;
        let Some(coefficients) = self.coefficients else {
            return Ok(None);
        };
        if let Some(value) = self.norm_share {
            return Err(LawError::Parameter {
                law: "power_two_term",
                parameter: "norm_share",
                value,
                expected: "left out where the coefficients are given",
            });
        }
        let law = Power::<D>::from_coefficients(coefficients, self.exponents_of_two_terms::<D>())?;
        let (least, expansion) = (law.least_compression(), law.expansion_coefficient());
        // Up to rounding, the least one is accepted.
        if coefficients.compression < least * (1.0 - 1e-12) {
            return Err(LawError::NotPolyconvex { expansion, least });
        }
        let moduli = law.moduli().checked()?;
        Ok(Some((law, moduli)))
    }

    /// Small exponents keep the bound on lambda low.
    fn exponents_of_two_terms<const D: usize>(&self) -> PowerExponents {
        self.exponents.unwrap_or(PowerExponents {
            norm: D as f64,
            cofactor: 2.0,
            expansion: 2.0,
            compression: 2.0,
        })
    }
}

impl From<[f64; 4]> for PowerExponents {
    /// From `p, q, r, s`.
    fn from([norm, cofactor, expansion, compression]: [f64; 4]) -> Self {
        Self {
            norm,
            cofactor,
            expansion,
            compression,
        }
    }
}

impl From<[f64; 3]> for PowerCoefficients {
    /// From `a1, a2, a3`.
    fn from([norm, cofactor, compression]: [f64; 3]) -> Self {
        Self {
            norm,
            cofactor,
            compression,
        }
    }
}

impl From<PowerExponents> for [f64; 4] {
    fn from(exponents: PowerExponents) -> Self {
        let PowerExponents {
            norm,
            cofactor,
            expansion,
            compression,
        } = exponents;
        [norm, cofactor, expansion, compression]
    }
}

impl From<PowerCoefficients> for [f64; 3] {
    fn from(coefficients: PowerCoefficients) -> Self {
        let PowerCoefficients {
            norm,
            cofactor,
            compression,
        } = coefficients;
        [norm, cofactor, compression]
    }
}

impl FromStr for PowerExponents {
    type Err = String;
    /// From `p,q,r,s`.
    fn from_str(text: &str) -> Result<Self, String> {
        numbers(text, "four exponents, such as 4,4,2,9").map(<[f64; 4]>::into)
    }
}

impl FromStr for PowerCoefficients {
    type Err = String;
    /// From `a1,a2,a3`.
    fn from_str(text: &str) -> Result<Self, String> {
        numbers(text, "three coefficients, such as 0.1,0.1,0.2").map(<[f64; 3]>::into)
    }
}

fn numbers<const N: usize>(text: &str, expected: &str) -> Result<[f64; N], String> {
    let numbers = text.split(',').map(|number| number.trim().parse::<f64>());
    let numbers: Result<Vec<f64>, _> = numbers.collect();
    let numbers = numbers.ok().and_then(|all| all.try_into().ok());
    numbers.ok_or_else(|| format!("give {expected}"))
}
