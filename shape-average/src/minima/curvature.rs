//! The least curvature at a minimum.

use super::rigid;
use crate::common;
use crate::error::AverageError;
use crate::objective::AverageObjective;
use crate::params::{AverageParams, BoundaryCondition};
use crate::result::AverageResult;
use fe_grid::minimise::{Curvature, LeastEigenvalueParams};
use fe_grid::{Field, rigid_motions};

/// A step along the direction moves the farthest node by this many spacings: over shorter ones the energy
/// follows the kinks of the discrete mismatch, which are steeper than its mean curvature.
const STEP: f64 = 2.0;

/// The curvature of the reduced functional at a result, for the mass of the objects,
///
/// ```text
/// v . M v = sum_i lambda_i int chi_i |v_i|^2 / sum_i lambda_i int chi_i,
/// ```
///
/// over all directions `v = (v_i)` but those that move all shapes together rigidly, which nothing resists. The
/// Hessian is that of a model without the jumps of the discrete mismatch, and without the curvature of the
/// boundaries, so that the model can be wrong where the objects are under stress. `None` where a curvature is
/// not finite.
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
    let together = rigid_motions(&result.displacements, &mass, 0);
    let turns = rigid::turns::<D>(&together, weights.len());
    let (motions, guesses) = match params.boundary {
        BoundaryCondition::Natural => (&together[..], &turns[..]),
        // Fixed faces hold the shapes already.
        BoundaryCondition::Identity => (&[][..], &[][..]),
    };
    let params = LeastEigenvalueParams::default();
    let Some(found) = params.find(&mut objective, &x, &mass, motions, guesses)? else {
        return Ok(None);
    };
    let step = STEP * result.average.grid().spacing();
    Curvature::along(
        &found,
        &mut objective,
        &x,
        step,
        result.energy.elastic_scale(),
    )
}
