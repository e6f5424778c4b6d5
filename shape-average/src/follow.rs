//! Shapes of weight zero: they have no say in the average, and are deformed onto it afterwards.
//!
//! Their elastic energy costs nothing, so that at the optimum they follow wherever the others go.
//! In one functional with the others they would do so in any way at all, folded up to the bound of
//! the determinant, and pull the average to themselves as long as they have not arrived. So the
//! others are averaged by themselves, with the same weight of a mismatch, and each of these is then
//! deformed onto the result with a small elastic weight, which makes the deformation a good one.

use crate::error::AverageError;
use crate::hierarchy::{LevelMinimiser, Levels, levels_of_seen, targets_of};
use crate::level::LevelShapes;
use crate::params::{AverageParams, Mean};
use crate::result::{AverageResult, Timing};
use fe_grid::minimise::{Observer, Status, minimise_levels};
use fe_grid::{Field, ScalarField};
use std::time::Instant;

/// Elastic weight of a shape that follows, beside a mismatch of its whole weight. With less,
/// deformations fold up to the bound on their determinant before they have arrived: a bent bar
/// comes to lie on a straight one with a Dice overlap of .95 at this weight, of .91 at half of it.
const ELASTIC_WEIGHT: f64 = 0.02;

/// The shapes of positive weight, by themselves, with the parameters of their average.
pub(crate) struct Leaders<const D: usize> {
    /// Signed distances.
    pub distances: Vec<ScalarField<f64, D>>,
    /// What was seen of each, or none.
    pub seen: Vec<ScalarField<f64, D>>,
    /// Displacements to start from, or none.
    pub known: Vec<Field<f64, D, D>>,
    /// Their weights, and a mismatch weight with which the mismatch of one costs what it costs
    /// among all.
    pub params: AverageParams,
}

impl<const D: usize> Leaders<D> {
    /// Those of all shapes whose weight is not zero.
    pub(crate) fn of(
        signed_distances: &[Field<f64, D, 1>],
        seen: &[Field<f64, D, 1>],
        known: &[Field<f64, D, D>],
        params: &AverageParams,
    ) -> Self {
        let n = signed_distances.len();
        let weights = params.resolved_weights(n);
        let leaders: Vec<usize> = (0..n).filter(|&i| weights[i] > 0.0).collect();
        let of_leaders = |fields: &[ScalarField<f64, D>]| -> Vec<_> {
            let found = leaders.iter().filter_map(|&i| fields.get(i));
            found.cloned().collect()
        };
        // What does not have one displacement a shape must not seem to fit.
        let known = if known.len() == n {
            leaders.iter().map(|&i| known[i].clone()).collect()
        } else {
            known.to_vec()
        };
        Self {
            distances: of_leaders(signed_distances),
            seen: of_leaders(seen),
            known,
            params: AverageParams {
                weights: Some(leaders.iter().map(|&i| weights[i]).collect()),
                mismatch_weight: params.mismatch_weight * leaders.len() as f64 / n as f64,
                length_weight: Some(params.resolved_length_weight()),
                ..params.clone()
            },
        }
    }
}

/// Adds the shapes of weight zero to the average of the others.
///
/// # Errors
/// Those of [`average`](crate::average).
pub(crate) fn with_followers<const D: usize>(
    result: AverageResult<D>,
    signed_distances: &[Field<f64, D, 1>],
    seen: &[Field<f64, D, 1>],
    params: &AverageParams,
    start: Instant,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    let n = signed_distances.len();
    let weights = params.resolved_weights(n);
    let leads = |i: usize| weights[i] > 0.0;
    let grid = *result.average.grid();
    let on_grid = |d: &ScalarField<f64, D>| ScalarField::from_fn(grid, |x| d.sample(x));
    let distances: Vec<_> = signed_distances.iter().map(on_grid).collect();
    let seen: Vec<_> = seen.iter().map(on_grid).collect();
    let target = levelset::signed_distance(&result.average_indicator, 0.5)?;
    let stopped = result
        .levels
        .last()
        .is_some_and(|level| level.status == Status::Cancelled);
    let mut x = Vec::with_capacity(n * D * grid.n_nodes());
    let mut led = result.displacements.iter();
    for i in 0..n {
        if !leads(i) && stopped {
            x.resize(x.len() + D * grid.n_nodes(), 0.0);
        } else if !leads(i) {
            let seen = seen.get(i).map_or(&[][..], std::slice::from_ref);
            x.extend(follow(&distances[i], seen, &target, params, observer)?);
        } else if let Some(displacement) = led.next() {
            x.extend_from_slice(displacement.as_slice());
        }
    }
    let mut levels = result.levels;
    for level in &mut levels {
        // Shapes that follow are no part of the functional.
        for terms in [&mut level.energy.elastic, &mut level.energy.mismatch] {
            let mut led = terms.clone().into_iter();
            *terms = (0..n)
                .map(|i| {
                    if leads(i) {
                        led.next().unwrap_or(0.0)
                    } else {
                        0.0
                    }
                })
                .collect();
        }
    }
    let shapes = LevelShapes::new(grid, &distances, params)?.with_seen(seen);
    let timing = Timing {
        levels: Vec::new(),
        seconds: start.elapsed().as_secs_f64(),
    };
    let seconds: Vec<f64> = levels.iter().map(|level| level.seconds).collect();
    let average = result.average.into_vec();
    let mut all = AverageResult::new(&distances, &weights, shapes, &x, average, levels, &timing)?;
    for (level, seconds) in all.levels.iter_mut().zip(seconds) {
        level.seconds = seconds;
    }
    Ok(all)
}

/// The displacement that carries a shape onto a target, both given by signed distances; of the shape
/// what was seen, where that is not everything.
fn follow<const D: usize>(
    distance: &ScalarField<f64, D>,
    seen: &[ScalarField<f64, D>],
    target: &ScalarField<f64, D>,
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<Vec<f64>, AverageError> {
    let own = AverageParams {
        weights: Some(vec![ELASTIC_WEIGHT]),
        mean: Mean::Arithmetic,
        ..params.clone()
    };
    let levels = levels_of_seen(std::slice::from_ref(distance), seen, &own)?;
    let dim = D * levels[0].grid().n_nodes();
    let mut problem = Levels::new(levels, &own).onto(targets_of(target, &own)?);
    let minimiser = |_| LevelMinimiser {
        params: own.clone(),
    };
    let quiet = &mut crate::quiet::Quiet(observer);
    let solution = minimise_levels(&mut problem, minimiser, vec![0.0; dim], quiet)?;
    let mut displacement = solution.x.to_vec();
    // A wish to stop ends it on a coarser grid: the shape then stays where it is.
    let size = D * distance.grid().n_nodes();
    if displacement.len() != size {
        displacement = vec![0.0; size];
    }
    Ok(displacement)
}
