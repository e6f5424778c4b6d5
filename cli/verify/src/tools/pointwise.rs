//! A law at one point, by its name.

use fe_grid::Tensor;
use hyperelastic::{Hypotheses, LameModuli, LawError, LawSpec, ViscousDissipation};

use crate::error::VerifyError;

/// What a law says at a displacement gradient.
#[derive(Clone, Copy, Debug)]
pub struct Response<const D: usize> {
    /// `W(1 + h)`.
    pub value: f64,
    /// First Piola–Kirchhoff stress.
    pub stress: Tensor<f64, D>,
    /// `W_,AA(1 + h)[b]`.
    pub action: Tensor<f64, D>,
}

/// A law of a name with moduli `lambda` and `mu`.
///
/// # Errors
/// [`VerifyError::Law`].
pub fn law(name: &str, lambda: f64, mu: f64) -> Result<LawSpec, VerifyError> {
    Ok(LawSpec::new(name, LameModuli::new(lambda, mu)?)?)
}

/// The energy density, stress and tangent at `1 + h`, the tangent applied to `b`.
///
/// # Errors
/// Where there is no such law.
pub fn response<const D: usize>(
    spec: &LawSpec,
    h: &Tensor<f64, D>,
    b: &Tensor<f64, D>,
) -> Result<Response<D>, LawError> {
    let law = spec.compile()?;
    let (value, stress) = law.gradient(h);
    Ok(Response {
        value,
        stress,
        action: law.hessian_action(h, b),
    })
}

/// The energy density at `1 + h`.
///
/// # Errors
/// Where there is no such law.
pub fn density<const D: usize>(spec: &LawSpec, h: &Tensor<f64, D>) -> Result<f64, LawError> {
    Ok(spec.compile()?.value(h))
}

/// What a law satisfies.
///
/// # Errors
/// Where there is no such law.
pub fn hypotheses<const D: usize>(spec: &LawSpec) -> Result<Hypotheses, LawError> {
    Ok(spec.compile::<D>()?.hypotheses())
}

/// The rate of viscous dissipation of a velocity gradient.
pub fn dissipation<const D: usize>(moduli: LameModuli, gradient: &Tensor<f64, D>) -> f64 {
    ViscousDissipation { moduli }.rate(gradient)
}
