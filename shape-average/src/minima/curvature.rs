//! The least curvature at a minimum.

use super::rigid;
use crate::common;
use crate::error::AverageError;
use crate::objective::AverageObjective;
use crate::params::{AverageParams, BoundaryCondition};
use crate::result::AverageResult;
use fe_grid::Field;
use fe_grid::minimise::{Evaluation, LeastEigenvalueParams};
use fe_grid::vector::{add_scaled_into, max_abs};
use levelset::Cause;
use levelset::Doubt;
use serde::Serialize;

/// A step along the direction moves the farthest node by this many spacings: over shorter ones the energy
/// follows the kinks of the discrete mismatch, which are steeper than its mean curvature.
const STEP: f64 = 2.0;
/// How often the step is halved where it folds a deformation.
const HALVINGS: usize = 5;
/// Multiples of the step at which lower energies are looked for.
const MULTIPLES: [f64; 5] = [0.1, 0.25, 0.5, 2.0, 4.0];

/// The least eigenvalue `lambda` of the Hessian `H` of the reduced functional, for the mass of the objects:
///
/// ```text
/// lambda = min v . H v / v . M v,    v . M v = sum_i lambda_i int chi_i |v_i|^2 / sum_i lambda_i int chi_i
/// ```
///
/// over all directions `v = (v_i)` but those that move all shapes together rigidly, which nothing resists
/// (they are `M`-orthogonal to `v`). A displacement of the points of all objects by `d` on average (root mean
/// square, in units of the box) along `v` raises the energy by `lambda d^2 / 2`.
///
/// `H` is that of a model without the jumps of the discrete mismatch, and without the curvature of the
/// boundaries, so that the model can be wrong where the objects are under stress. The functional itself is
/// therefore tried along `v`, too.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Curvature {
    /// The least eigenvalue found; the least one of the model is not above it.
    pub value: f64,
    /// Its estimated error.
    pub error: f64,
    /// Applications of the Hessian.
    pub actions: usize,
    /// Whether the error is small.
    pub converged: bool,
    /// The second difference of the functional along `v`, for a step that moves the farthest node by two
    /// spacings, or less where that would fold a deformation. `None` if every step does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<f64>,
    /// How far the energy falls along `v` or `-v`, relative to the elastic energy, at most: 0 at a minimum.
    pub fall: f64,
}

impl Curvature {
    /// Whether the energy falls along the direction by more than the minimiser leaves.
    pub fn is_saddle(&self) -> bool {
        Doubt::check(Cause::Saddle, self.fall).is_some()
    }
}

/// The curvature at a result; `None` where a curvature is not finite.
pub(super) fn at<const D: usize>(
    result: &AverageResult<D>,
    params: &AverageParams,
    weights: &[f64],
) -> Result<Option<Curvature>, AverageError> {
    let average = result.all_averages();
    let mut objective = AverageObjective::new(result.shapes.clone(), params, average)?;
    objective.common_regularisation = common::ESTIMATE;
    let fields = result.displacements.iter().map(Field::as_slice);
    let x: Vec<f64> = fields.flatten().copied().collect();
    let mass = rigid::mass(&result.shapes, weights, params.void_stiffness);
    let together = rigid::motions(&result.displacements, &mass);
    let turns = rigid::turns::<D>(&together, weights.len());
    let [motions, guesses] = match params.boundary {
        BoundaryCondition::Natural => [&together[..], &turns],
        // Fixed faces hold the shapes already.
        BoundaryCondition::Identity => [&[][..], &[]],
    };
    let params = LeastEigenvalueParams::default();
    let Some(found) = params.find(&mut objective, &x, &mass, motions, guesses)? else {
        return Ok(None);
    };
    let Evaluation::Value(energy) = objective.evaluate_energy(&x)? else {
        return Ok(None);
    };
    let mut moved = vec![0.0; x.len()];
    // How much the energy changes along a multiple of the direction.
    let mut change = |step: f64| -> Result<Option<f64>, AverageError> {
        add_scaled_into(&x, step, &found.direction, &mut moved);
        Ok(match objective.evaluate_energy(&moved)? {
            Evaluation::Value(other) => Some(other - energy),
            Evaluation::Inadmissible => None,
        })
    };
    let spacing = result.average.grid().spacing();
    let mut step = STEP * spacing / max_abs(&found.direction);
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
    Ok(Some(Curvature {
        value: found.value,
        error: found.error,
        actions: found.actions,
        converged: found.converged,
        measured,
        fall: lowest.abs() / result.elastic_scale(),
    }))
}
