//! The curvature of an energy at a state, and how far the energy falls from there.

use super::least_eigenvalue::LeastEigenvalue;
use super::objective::Objective;
use crate::vector::{add_scaled_into, max_abs};
use serde::Serialize;

/// How often the step is halved where it folds a deformation.
const HALVINGS: usize = 5;
/// Multiples of the step at which lower energies are looked for.
const MULTIPLES: [f64; 5] = [0.1, 0.25, 0.5, 2.0, 4.0];

/// The least eigenvalue `lambda` of the Hessian `H` of an energy, for the mass `M` of its objects,
///
/// `lambda = min  v . H v / v . M v`,
///
/// over all directions `v` but the rigid motions that nothing resists, as
/// [`LeastEigenvalueParams::find`](super::LeastEigenvalueParams::find) computes it, and what the energy itself
/// does along `v`. Where `v . M v` is a mean square of displacements, a displacement by `d` (root mean square) along
/// `v` raises the energy by `lambda d^2 / 2`.
///
/// `H` may be that of a model, which can be wrong. The energy itself is therefore tried along `v`, too.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Curvature {
    /// The least eigenvalue found; the least one is not above it.
    pub value: f64,
    /// Its estimated error.
    pub error: f64,
    /// Applications of the Hessian.
    pub actions: usize,
    /// Whether the error is small.
    pub converged: bool,
    /// The second difference of the energy along `v`, for a step that is small, or smaller where it would
    /// fold a deformation. `None` if every step does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<f64>,
    /// How far the energy falls along `v` or `-v` at most, relative to a scale, such as the elastic energy: 0 at
    /// a minimum.
    pub fall: f64,
}

impl Curvature {
    /// Tries the energy of an objective along the direction of the least eigenvalue at `x`, with steps that move the
    /// farthest node by a length and by multiples of it. Falls are relative to `scale`. `None` where `x` is
    /// inadmissible.
    ///
    /// # Errors
    /// Those of the objective.
    pub fn along<O: Objective>(
        found: &LeastEigenvalue,
        objective: &mut O,
        x: &[f64],
        length: f64,
        scale: f64,
    ) -> Result<Option<Self>, O::Error> {
        let Some(energy) = objective.value(x)?.energy() else {
            return Ok(None);
        };
        let mut moved = vec![0.0; x.len()];
        let mut change = |step: f64| -> Result<Option<f64>, O::Error> {
            add_scaled_into(x, step, &found.direction, &mut moved);
            let other = objective.value(&moved)?.energy();
            Ok(other.map(|other| other - energy))
        };
        let mut step = length / max_abs(&found.direction);
        let (mut measured, mut lowest) = (None, 0.0f64);
        for _ in 0..=HALVINGS {
            if let (Some(ahead), Some(back)) = (change(step)?, change(-step)?) {
                measured = Some((ahead + back) / (step * step));
                lowest = lowest.min(ahead).min(back);
                break;
            }
            step *= 0.5;
        }
        for sign in [1.0, -1.0] {
            for multiple in MULTIPLES {
                let Some(other) = change(sign * step * multiple)? else {
                    break;
                };
                lowest = lowest.min(other);
            }
        }
        Ok(Some(Self {
            value: found.value,
            error: found.error,
            actions: found.actions,
            converged: found.converged,
            measured,
            fall: lowest.abs() / scale,
        }))
    }
}
