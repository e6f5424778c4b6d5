//! What can be wrong with a law that is asked for.

/// A law could not be made from the parameters given.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LawError {
    /// The Lamé moduli are not those of a stable solid.
    #[error(
        "the moduli lambda = {lambda}, mu = {mu} are not usable: lambda must be \
         finite and not negative, mu finite and positive"
    )]
    Moduli {
        /// First Lamé modulus given.
        lambda: f64,
        /// Shear modulus given.
        mu: f64,
    },
    /// A parameter of a law is outside its range.
    #[error("{law}: the parameter {parameter} = {value} must be {expected}")]
    Parameter {
        /// The law.
        law: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// The value given.
        value: f64,
        /// The range allowed, in words.
        expected: &'static str,
    },
    /// The first Lamé modulus lies below what the law can reach.
    #[error(
        "{law}: lambda = {lambda} is below the bound {bound} that holds when the share \
         {norm_share} of the shear modulus comes from the |A|^p term; raise lambda, lower mu, or \
         choose other exponents or another share"
    )]
    LambdaBelowBound {
        /// The law.
        law: &'static str,
        /// First Lamé modulus given.
        lambda: f64,
        /// The smallest that this share allows.
        bound: f64,
        /// Share of the shear modulus carried by the `|A|^p` term.
        norm_share: f64,
    },
    /// Another law has this name.
    #[error("there is a law named '{name}' already; choose another name")]
    NameTaken {
        /// The name asked for.
        name: String,
    },
    /// No law has this name.
    #[error("there is no law named '{name}'; known are {known}")]
    UnknownLaw {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
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
