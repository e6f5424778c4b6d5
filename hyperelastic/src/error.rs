//! Errors of this crate.

/// Error in the specification of a law.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LawError {
    /// The Lamé moduli are not those of a stable solid, or their squares overflow.
    #[error(
        "the moduli lambda = {lambda:e}, mu = {mu:e} are not usable: lambda must be from 0 to 1e12, \
         mu from 1e-12 to 1e12"
    )]
    Moduli {
        /// The given first Lamé parameter.
        lambda: f64,
        /// The given shear modulus.
        mu: f64,
    },
    /// A parameter of a law is outside its range.
    #[error("{law}: the parameter {parameter} = {value} must be {expected}")]
    Parameter {
        /// The law.
        law: &'static str,
        /// Name of the parameter.
        parameter: &'static str,
        /// The given value.
        value: f64,
        /// The admissible values, in words.
        expected: &'static str,
    },
    /// The first Lamé parameter is below the bound of the law.
    #[error(
        "{law}: lambda = {lambda} is below the bound {bound} that holds when the share \
         {norm_share} of the shear modulus comes from the |A|^p term; raise lambda, lower mu, or \
         choose other exponents or another share"
    )]
    LambdaBelowBound {
        /// The law.
        law: &'static str,
        /// The given first Lamé parameter.
        lambda: f64,
        /// Lower bound for this share.
        bound: f64,
        /// Fraction of the shear modulus due to the `|A|^p` term.
        norm_share: f64,
    },
    /// The coefficients of the law of two terms make its energy unbounded from below.
    #[error(
        "with these coefficients the law has {expansion} det^r and is not polyconvex: its energy may be \
         negative; a3 must be at least {least}"
    )]
    NotPolyconvex {
        /// The factor of `det^r` that makes the identity stress free.
        expansion: f64,
        /// The least `a3` with which it is not negative.
        least: f64,
    },
    /// An option of power laws is set for another law, or coefficients for a law that has moduli.
    #[error(
        "{law} has no option {option}: leave it out, or choose the law {}",
        law_with(option)
    )]
    Option {
        /// The option.
        option: &'static str,
        /// The law.
        law: String,
    },
    /// The moduli are not those of the coefficients of a power law.
    #[error("with these coefficients lambda is {lambda} and mu is {mu}: state these moduli")]
    ModuliDiffer {
        /// First Lamé parameter of the coefficients.
        lambda: f64,
        /// Shear modulus of the coefficients.
        mu: f64,
    },
    /// The name is already used by another law.
    #[error("there is a law named '{name}' already; choose another name")]
    NameTaken {
        /// The requested name.
        name: String,
    },
    /// A law cannot have this name.
    #[error("a law cannot be named '{name}': names are made of letters, digits, '_' and '-'")]
    BadName {
        /// The requested name.
        name: String,
    },
    /// No law has this name.
    #[error("there is no law named '{name}'; known are {known}")]
    UnknownLaw {
        /// The requested name.
        name: String,
        /// The known names.
        known: String,
    },
}

/// The laws that have an option.
fn law_with(option: &str) -> &'static str {
    match option {
        "coefficients" => "power_two_term",
        _ => "power or power_two_term",
    }
}

/// Checks that a parameter satisfies a condition.
pub(crate) fn require(
    holds: bool,
    law: &'static str,
    parameter: &'static str,
    value: f64,
    expected: &'static str,
) -> Result<(), LawError> {
    if holds && value.is_finite() {
        Ok(())
    } else {
        Err(LawError::Parameter {
            law,
            parameter,
            value,
            expected,
        })
    }
}
