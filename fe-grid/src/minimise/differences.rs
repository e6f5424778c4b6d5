//! Derivatives against differences.
//!
//! The relative error of a central difference, `|difference - derivative| / |derivative|`, is of second
//! order in the step until rounding, some `1e-16 / t` of the energy, exceeds it. That of a wrong
//! derivative does not decrease with the step.

use super::objective::{Evaluation, Objective, SecondOrder};
use crate::vector::dot;

/// Compares a gradient with central differences `(f(x + t d) - f(x - t d)) / 2 t` along a
/// direction `d`, for each of the steps `t`, and returns pairs of the step and the relative error, not a
/// number where a value is none.
///
/// # Errors
/// Those of `value`.
///
/// # Panics
/// If lengths differ.
pub fn compare_with_differences<E>(
    x: &[f64],
    direction: &[f64],
    gradient: &[f64],
    steps: &[f64],
    mut value: impl FnMut(&[f64]) -> Result<f64, E>,
) -> Result<Vec<(f64, f64)>, E> {
    assert_eq!(x.len(), direction.len());
    let derivative = dot(gradient, direction);
    let errors = steps.iter().map(|&step| {
        let [plus, minus] = [step, -step].map(|t| moved(x, t, direction));
        let difference = (value(&plus)? - value(&minus)?) / (2.0 * step);
        Ok((step, (difference - derivative).abs() / derivative.abs()))
    });
    errors.collect()
}

/// Compares the gradient of an objective at `x` with differences of its value along a direction.
///
/// ```
/// use fe_grid::GridError;
/// use fe_grid::minimise::{Evaluation, Objective, gradient_errors};
///
/// struct Quartic;
/// impl Objective for Quartic {
///     type Error = GridError;
///     fn dim(&self) -> usize {
///         1
///     }
///     fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, GridError> {
///         g[0] = 4.0 * x[0].powi(3);
///         Ok(Evaluation::Value(x[0].powi(4)))
///     }
/// }
///
/// let found = gradient_errors(&mut Quartic, &[1.0], &[1.0], &[1e-2, 1e-3])?;
/// // The difference is 4 + 4 t^2.
/// assert!(found.iter().all(|(t, error)| (error / (t * t) - 1.0).abs() < 1e-3));
/// # Ok::<(), GridError>(())
/// ```
///
/// # Errors
/// Those of the objective.
///
/// # Panics
/// If lengths differ.
pub fn gradient_errors<O: Objective>(
    objective: &mut O,
    x: &[f64],
    direction: &[f64],
    steps: &[f64],
) -> Result<Vec<(f64, f64)>, O::Error> {
    let mut gradient = vec![0.0; objective.dim()];
    objective.value_and_gradient(x, &mut gradient)?;
    compare_with_differences(x, direction, &gradient, steps, |x| {
        objective.value(x).map(number)
    })
}

/// Compares the second derivative of an objective at `x` with differences of its gradient: of
/// `gradient . test`, along a direction. With several random `test` a wrong row is found.
///
/// # Errors
/// Those of the objective.
///
/// # Panics
/// If lengths differ.
pub fn hessian_errors<O: SecondOrder>(
    objective: &mut O,
    x: &[f64],
    direction: &[f64],
    test: &[f64],
    steps: &[f64],
) -> Result<Vec<(f64, f64)>, O::Error> {
    let mut gradient = vec![0.0; objective.dim()];
    // The action is asked for at a state whose gradient was computed last.
    objective.value_and_gradient(x, &mut gradient)?;
    let mut action = vec![0.0; objective.dim()];
    objective.hessian_action(x, test, &mut action)?;
    compare_with_differences(x, direction, &action, steps, |x| {
        let evaluation = objective.value_and_gradient(x, &mut gradient)?;
        let finite = number(evaluation).is_finite();
        Ok(if finite {
            dot(&gradient, test)
        } else {
            f64::NAN
        })
    })
}

fn number(evaluation: Evaluation) -> f64 {
    match evaluation {
        Evaluation::Value(value) => value,
        Evaluation::Inadmissible => f64::NAN,
    }
}

fn moved(x: &[f64], t: f64, direction: &[f64]) -> Vec<f64> {
    x.iter().zip(direction).map(|(x, d)| x + t * d).collect()
}
