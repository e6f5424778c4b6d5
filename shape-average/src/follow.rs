//! Shapes of weight zero: they do not influence the average, and are deformed onto it afterwards.
//!
//! At weight zero the elastic energy of these shapes does not enter the functional. Minimised
//! together with the others, their deformations would be arbitrary, folded up to the bound on the
//! determinant, and their mismatch would attract the average until they have reached it. Therefore
//! the other shapes are averaged alone, with the same weight of a mismatch, and each shape of
//! weight zero is then deformed onto the result with a small elastic weight, which regularises the
//! deformation.

use crate::error::AverageError;
use crate::hierarchy::{LevelMinimiser, Levels, levels_of_visible, targets_of};
use crate::level::LevelShapes;
use crate::params::{AverageParams, Mean};
use crate::result::{AverageResult, Timing};
use fe_grid::minimise::{Observer, Status, minimise_levels};
use fe_grid::{Field, ScalarField};
use std::time::Instant;

/// Elastic weight of a shape of weight zero, relative to the full weight of its mismatch. With
/// less, deformations fold up to the bound on their determinant before they reach the average: a
/// bent bar reaches a straight one with a Dice overlap of .95 at this weight, of .91 at half of it.
const ELASTIC_WEIGHT: f64 = 0.02;

/// The shapes of positive weight, with the parameters of their average.
pub(crate) struct Leaders<const D: usize> {
    /// Signed distances.
    pub distances: Vec<ScalarField<f64, D>>,
    /// Visibility mask of each shape, or empty.
    pub seen: Vec<ScalarField<f64, D>>,
    /// Initial displacements, or empty.
    pub known: Vec<Field<f64, D, D>>,
    /// Parameters with the weights of these shapes, and a mismatch weight that gives the mismatch
    /// of one shape the same weight as in the full group.
    pub params: AverageParams,
}

impl<const D: usize> Leaders<D> {
    /// Selects the shapes whose weight is not zero.
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
        // Displacements that are not one per shape are passed on unchanged, so that the error is
        // reported.
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
        // Shapes of weight zero do not enter the functional.
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
    let shapes = LevelShapes::new(grid, &distances, params)?.with_visibility(seen);
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

/// Computes the displacement that deforms a shape onto a target, both given by signed distances,
/// with the visibility mask of the shape if it has one.
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
    let levels = levels_of_visible(std::slice::from_ref(distance), seen, &own)?;
    let dim = D * levels[0].grid().n_nodes();
    let mut problem = Levels::new(levels, &own).onto(targets_of(target, &own)?);
    let minimiser = |_| LevelMinimiser {
        params: own.clone(),
    };
    let quiet = &mut crate::quiet::Quiet(observer);
    let solution = minimise_levels(&mut problem, minimiser, vec![0.0; dim], quiet)?;
    let mut displacement = solution.x.to_vec();
    // A cancelled run ends on a coarser grid: the shape is then not deformed.
    let size = D * distance.grid().n_nodes();
    if displacement.len() != size {
        displacement = vec![0.0; size];
    }
    Ok(displacement)
}
