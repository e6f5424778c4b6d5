//! Construction of compiled laws from a name and two moduli.
//!
//! To add a law: one file for it, one line in [`Family`]'s table, one in `compile_in`. A law of
//! another crate is added by [`register_law`].

use crate::compiled::CompiledLaw;
use crate::error::LawError;
use crate::inverse::Inverse;
use crate::linear_elasticity::LinearElasticity;
use crate::logdet::LogDet;
use crate::logdet_barrier::LogDetBarrier;
use crate::moduli::LameModuli;
use crate::own_law::OwnLaw;
use crate::power::{Power, PowerCoefficients, PowerExponents};
use crate::power_options::PowerOptions;
use crate::stored_energy::StoredEnergy;
use fe_grid::compiled_once;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The named laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Family {
    /// [`LogDet`].
    LogDet,
    /// [`LogDetBarrier`].
    LogDetBarrier,
    /// [`Power`] with a null Lagrangian in its volume function, for all moduli.
    Power,
    /// [`Power`] with a two-term volume function, for large `lambda / mu` only.
    PowerTwoTerm,
    /// [`LinearElasticity`].
    Linear,
    /// A law of another crate; see [`register_law`].
    Own(OwnLaw),
}

/// Registers a law of another crate under a name, by which averages, geodesics and principal
/// component analyses can select it like any other. The registration lasts until the program ends.
///
/// The two functions create the law from its moduli, in 2D and in 3D, with [`CompiledLaw::new`].
///
/// # Errors
/// [`LawError::NameTaken`] if the name is already used, [`LawError::BadName`] unless it is made of
/// letters, digits, `_` and `-`.
pub fn register_law(
    name: &str,
    in_plane: fn(LameModuli) -> Result<CompiledLaw<2>, LawError>,
    in_space: fn(LameModuli) -> Result<CompiledLaw<3>, LawError>,
) -> Result<LawName, LawError> {
    let taken = || LawError::NameTaken {
        name: name.to_owned(),
    };
    let allowed = |c: char| c.is_alphanumeric() || "_-".contains(c);
    if name.is_empty() || !name.chars().all(allowed) {
        return Err(LawError::BadName {
            name: name.to_owned(),
        });
    }
    if name.parse::<LawName>().is_ok() {
        return Err(taken());
    }
    let law = OwnLaw::register(name, in_plane, in_space).ok_or_else(taken)?;
    Ok(LawName {
        family: Family::Own(law),
        inverse: false,
    })
}

impl Family {
    const TABLE: [(&'static str, Self); 5] = [
        ("logdet", Self::LogDet),
        ("logdet_barrier", Self::LogDetBarrier),
        ("power", Self::Power),
        ("power_two_term", Self::PowerTwoTerm),
        ("linear", Self::Linear),
    ];
}

/// A law by name: a family, or the inverse model of one (`"inverse:logdet"`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct LawName {
    family: Family,
    inverse: bool,
}

impl LawName {
    const INVERSE: &'static str = "inverse:";

    /// Returns all names, in the order in which they are listed to a user.
    pub fn all() -> impl Iterator<Item = Self> {
        let with = |inverse: bool| {
            Family::TABLE
                .into_iter()
                .map(move |(_, family)| Self { family, inverse })
        };
        let own = OwnLaw::all().map(|law| Self {
            family: Family::Own(law),
            inverse: false,
        });
        with(false)
            .chain(with(true).filter(|name| name.family != Family::Linear))
            .chain(own)
    }

    /// Returns the family.
    pub fn family(self) -> Family {
        self.family
    }

    /// Returns the law of the inverse deformation, `det A W(A^-1)`; the inverse model of an inverse
    /// model is the law itself. Linear elasticity and laws of users have none.
    pub fn inverted(self) -> Option<Self> {
        let has_inverse = !matches!(self.family, Family::Linear | Family::Own(_));
        has_inverse.then_some(Self {
            inverse: !self.inverse,
            ..self
        })
    }

    /// Returns the specification of this law with these moduli.
    pub fn with(self, moduli: LameModuli) -> LawSpec {
        LawSpec {
            law: self,
            moduli,
            power: PowerOptions::default(),
        }
    }
}

impl Default for LawName {
    /// `logdet`.
    fn default() -> Self {
        Self {
            family: Family::LogDet,
            inverse: false,
        }
    }
}

impl fmt::Display for LawName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.inverse {
            f.write_str(Self::INVERSE)?;
        }
        if let Family::Own(law) = self.family {
            return f.write_str(&law.name());
        }
        let found = Family::TABLE.iter().find(|(_, x)| *x == self.family);
        f.write_str(found.map_or("", |(name, _)| name))
    }
}

impl FromStr for LawName {
    type Err = LawError;
    fn from_str(name: &str) -> Result<Self, LawError> {
        Self::all()
            .find(|known| known.to_string() == name)
            .ok_or_else(|| LawError::UnknownLaw {
                name: name.to_owned(),
                known: Self::all()
                    .map(|known| known.to_string())
                    .collect::<Vec<_>>()
                    .join(", "),
            })
    }
}

impl TryFrom<String> for LawName {
    type Error = LawError;
    fn try_from(name: String) -> Result<Self, LawError> {
        name.parse()
    }
}

impl From<LawName> for String {
    fn from(name: LawName) -> Self {
        name.to_string()
    }
}

/// A law, its moduli, and what else may be chosen of a power law. A configuration states them side by
/// side: `law`, `lambda`, `mu`, and the keys of [`PowerOptions`] that are set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(from = "Stated", into = "Stated")]
pub struct LawSpec {
    /// Elastic law (stored energy density); "inverse:..." is the inverse model of a law.
    #[cfg_attr(feature = "clap", arg(long, value_name = "LAW", value_parser = law_names()))]
    pub law: LawName,
    /// Its Lamé parameters.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub moduli: LameModuli,
    /// Exponents and coefficients of a power law.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub power: PowerOptions,
}

/// Serialised form of a [`LawSpec`].
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Stated {
    law: LawName,
    lambda: f64,
    mu: f64,
    /// `p, q, r, s`; keys that are not set are left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    exponents: Option<[f64; 4]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    norm_share: Option<f64>,
    /// `a1, a2, a3`.
    #[serde(skip_serializing_if = "Option::is_none")]
    coefficients: Option<[f64; 3]>,
}

impl Default for Stated {
    fn default() -> Self {
        LawSpec::default().into()
    }
}

impl From<Stated> for LawSpec {
    fn from(stated: Stated) -> Self {
        let Stated { lambda, mu, .. } = stated;
        Self {
            law: stated.law,
            moduli: LameModuli { lambda, mu },
            power: PowerOptions {
                exponents: stated.exponents.map(PowerExponents::from),
                norm_share: stated.norm_share,
                coefficients: stated.coefficients.map(PowerCoefficients::from),
            },
        }
    }
}

impl From<LawSpec> for Stated {
    fn from(spec: LawSpec) -> Self {
        let LameModuli { lambda, mu } = spec.moduli;
        Self {
            law: spec.law,
            lambda,
            mu,
            exponents: spec.power.exponents.map(PowerExponents::into),
            norm_share: spec.power.norm_share,
            coefficients: spec.power.coefficients.map(PowerCoefficients::into),
        }
    }
}

/// Returns the names of all laws, as values of an option.
#[cfg(feature = "clap")]
fn law_names() -> impl clap::builder::TypedValueParser<Value = LawName> {
    use clap::builder::{PossibleValuesParser, TypedValueParser};
    let names: Vec<String> = LawName::all().map(|law| law.to_string()).collect();
    PossibleValuesParser::new(names).try_map(|name| name.parse::<LawName>())
}

impl LawSpec {
    /// Creates the specification of the law of this name with these moduli.
    ///
    /// # Errors
    /// [`LawError::UnknownLaw`] for an unknown name. The moduli are checked when the law is
    /// compiled.
    pub fn new(name: &str, moduli: LameModuli) -> Result<Self, LawError> {
        Ok(name.parse::<LawName>()?.with(moduli))
    }

    /// Returns the specification with the moduli that the coefficients of a power law have in `D`
    /// dimensions; without coefficients it is the same.
    ///
    /// # Errors
    /// As [`LawSpec::compile`].
    pub fn resolved<const D: usize>(&self) -> Result<Self, LawError> {
        self.check_options()?;
        let found = match self.law.family {
            Family::PowerTwoTerm => self.power.of_coefficients::<D>()?,
            _ => None,
        };
        let moduli = found.map_or(self.moduli, |(_, moduli)| moduli);
        Ok(Self { moduli, ..*self })
    }

    fn check_options(&self) -> Result<(), LawError> {
        let power = matches!(self.law.family, Family::Power | Family::PowerTwoTerm);
        match self.power.first_set() {
            Some(option) if !power => Err(LawError::Option {
                option,
                law: self.law.to_string(),
            }),
            _ => Ok(()),
        }
    }

    /// Creates the compiled law.
    ///
    /// # Errors
    /// Those of the law's constructor: moduli out of range, or below the law's bound.
    /// [`LawError::Option`] for options of a power law where the law is another, and
    /// [`LawError::ModuliDiffer`] for moduli that are not those of the coefficients
    /// ([`LawSpec::resolved`]).
    pub fn compile<const D: usize>(&self) -> Result<CompiledLaw<D>, LawError> {
        compile(self)
    }
}

compiled_once! {
    /// Creates the specified law, compiled with this crate.
    fn compile<'a, D>(spec: &'a LawSpec) -> Result<CompiledLaw<D>, LawError> = compile_in;
}

fn compile_in<const D: usize>(spec: &LawSpec) -> Result<CompiledLaw<D>, LawError> {
    spec.check_options()?;
    let moduli = spec.moduli;
    let inverse = spec.law.inverse;
    match spec.law.family {
        Family::LogDet => Ok(compile_one(LogDet::<D>::new(moduli)?, inverse)),
        Family::LogDetBarrier => Ok(compile_one(LogDetBarrier::<D>::new(moduli)?, inverse)),
        Family::Power | Family::PowerTwoTerm => Ok(compile_one(power::<D>(spec)?, inverse)),
        // Linear elasticity has no inverse model: its name cannot be parsed.
        Family::Linear => Ok(CompiledLaw::new(LinearElasticity::<D>::new(moduli)?)),
        Family::Own(law) => law.compile(moduli),
    }
}

/// Compiles a law or its inverse model.
fn compile_one<W: StoredEnergy<D>, const D: usize>(law: W, inverse: bool) -> CompiledLaw<D> {
    if inverse {
        CompiledLaw::new(Inverse::new(law))
    } else {
        CompiledLaw::new(law)
    }
}

/// Creates a power law. Both power laws have the same type, so its kernels are compiled once.
fn power<const D: usize>(spec: &LawSpec) -> Result<Power<D>, LawError> {
    if spec.law.family == Family::PowerTwoTerm {
        spec.power.two_term(spec.moduli)
    } else {
        spec.power.null_lagrangian(spec.moduli)
    }
}
