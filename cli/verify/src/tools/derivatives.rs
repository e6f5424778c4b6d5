//! Gradients against differences of values.

use fe_grid::vector::dot;

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
    let along = dot(gradient, direction);
    let at = |t: f64| -> Result<f64, VerifyError> {
        let moved: Vec<f64> = state
            .iter()
            .zip(direction)
            .map(|(x, d)| x + t * d)
            .collect();
        value(&moved)
    };
    steps
        .iter()
        .map(|&t| {
            Ok((
                t,
                ((at(t)? - at(-t)?) / (2.0 * t) - along).abs() / along.abs(),
            ))
        })
        .collect()
}
