//! Gradients against differences of values, with the errors of experiments.

use fe_grid::minimise::compare_with_differences;

use crate::error::VerifyError;

/// The errors of central differences of a function against its gradient, relative to it, along a
/// direction, with the steps: `(step, error)`.
///
/// # Errors
/// Those of the function.
pub fn against_differences(
    state: &[f64],
    direction: &[f64],
    gradient: &[f64],
    steps: &[f64],
    value: impl Fn(&[f64]) -> Result<f64, VerifyError>,
) -> Result<Vec<(f64, f64)>, VerifyError> {
    compare_with_differences(state, direction, gradient, steps, value)
}
