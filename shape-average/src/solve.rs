//! Entry points: averages of shapes, and the deformation of a shape onto an average.

use crate::error::AverageError;
use crate::follow::{Leaders, with_followers};
use crate::hierarchy::{Levels, levels_of, levels_of_visible, solve_levels, targets_of};
use crate::level::LevelShapes;
use crate::params::{AverageParams, Mean, Solver};
use crate::result::AverageResult;
use crate::together::Together;
use fe_grid::communicator::{Alone, Communicator};
use fe_grid::minimise::Observer;
use fe_grid::{Distribution, Field, Grid, compiled_once};
use std::sync::Arc;
use std::time::Instant;

/// Computes the average of shapes given by their signed distances (positive inside) on one grid.
///
/// The observer is notified of every level and iteration and may cancel; the result is then the
/// state reached so far.
///
/// # Errors
/// [`AverageError`] for parameters out of range, shapes on different grids, shapes without
/// inside or outside, and solvers that break down. Failure to converge is not an error; it is
/// reported in the status of the levels.
pub fn average<const D: usize>(
    signed_distances: &[Field<f64, D, 1>],
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    average_of_visible(signed_distances, &[], params, observer)
}

/// Computes the average of partially visible shapes.
///
/// `seen` has one visibility mask per shape, on the same grid: 1 where the shape is visible, 0
/// where it is hidden. The mismatch of a shape is not charged where it is hidden, so there the
/// shape does not influence the average, and its signed distance may be arbitrary. Overlaps and
/// distances in the result are measured on the visible parts.
///
/// # Errors
/// As [`average`], and [`AverageError::Masked`] for masks that do not fit the shapes.
pub fn average_of_visible<const D: usize>(
    signed_distances: &[Field<f64, D, 1>],
    seen: &[Field<f64, D, 1>],
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    average_from(signed_distances, seen, &[], params, observer)
}

compiled_once! {
    /// Computes the average from known deformations, such as those of a run that was stopped or of
    /// one on a coarser grid.
    ///
    /// `seen` and `start` are empty, or have one mask and one displacement per shape. The
    /// displacements lie on one of the grids of the hierarchy of the shapes' grid; coarser grids
    /// are skipped. A displacement that is not admissible is interpolated towards the identity
    /// until it is.
    ///
    /// # Errors
    /// As [`average_of_visible`], and [`AverageError::Start`] for displacements that do not fit.
    pub fn average_from<'a, D>(
        signed_distances: &'a [Field<f64, D, 1>],
        seen: &'a [Field<f64, D, 1>],
        start: &'a [Field<f64, D, D>],
        params: &'a AverageParams,
        observer: &'a mut dyn Observer,
    ) -> Result<AverageResult<D>, AverageError> = average_from_in;
}

fn average_from_in<const D: usize>(
    signed_distances: &[Field<f64, D, 1>],
    seen: &[Field<f64, D, 1>],
    known: &[Field<f64, D, D>],
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    let alone: Arc<dyn Communicator> = Arc::new(Alone);
    let found = average_distributed(alone, signed_distances, seen, known, params, observer);
    of_first(found?)
}

compiled_once! {
    /// Computes the average, as [`average_from`] does, on several processes: each has some of the shapes,
    /// and the first has the result; the others have `None`.
    ///
    /// All processes call this with the same arguments, but for the observer, of which that of the first is
    /// asked. The result has the same bits on any number of processes. Shapes of weight zero are deformed
    /// on the first.
    ///
    /// # Errors
    /// As [`average_from`], and [`AverageError::Distributed`] where there are several processes and the
    /// solver is [`Solver::Descent`].
    pub fn average_distributed<'a, D>(
        communicator: Arc<dyn Communicator>,
        signed_distances: &'a [Field<f64, D, 1>],
        seen: &'a [Field<f64, D, 1>],
        start: &'a [Field<f64, D, D>],
        params: &'a AverageParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Option<AverageResult<D>>, AverageError> = average_distributed_in;
}

fn average_distributed_in<const D: usize>(
    communicator: Arc<dyn Communicator>,
    signed_distances: &[Field<f64, D, 1>],
    seen: &[Field<f64, D, 1>],
    known: &[Field<f64, D, D>],
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<Option<AverageResult<D>>, AverageError> {
    check(signed_distances, params)?;
    let processes = communicator.size();
    if processes > 1 && params.solver == Solver::Descent {
        let what = "gradient descent";
        return Err(AverageError::Distributed { what, processes });
    }
    check_visibility(signed_distances, seen)?;
    let start = Instant::now();
    let weights = params.resolved_weights(signed_distances.len());
    if weights.contains(&0.0) {
        let led = Leaders::of(signed_distances, seen, known, params);
        let (distances, own) = (&led.distances, &led.params);
        let found = average_distributed_in(
            communicator,
            distances,
            &led.seen,
            &led.known,
            own,
            observer,
        )?;
        let follow = |own| with_followers(own, signed_distances, seen, params, start, observer);
        return found.map(follow).transpose();
    }
    let distribution = Distribution::over(communicator, signed_distances.len());
    let mut levels = levels_of_visible(signed_distances, seen, params, &distribution)?;
    let grids: Vec<Grid<D>> = levels.iter().map(|level| *level.grid()).collect();
    levels.drain(..first_level(&grids, signed_distances.len(), known)?);
    let known = known.get(distribution.own()).unwrap_or_default();
    if distribution.is_alone() {
        return solve(signed_distances, levels, known, params, start, observer);
    }
    let mut together = Together {
        observer,
        distribution,
    };
    solve(
        signed_distances,
        levels,
        known,
        params,
        start,
        &mut together,
    )
}

/// The result of the only process.
fn of_first<const D: usize>(
    found: Option<AverageResult<D>>,
) -> Result<AverageResult<D>, AverageError> {
    found.ok_or(AverageError::NoShapes)
}

/// Returns the level whose grid is that of the initial displacements; the first without any.
///
/// # Errors
/// [`AverageError::Start`].
pub(crate) fn first_level<const D: usize>(
    grids: &[Grid<D>],
    n_shapes: usize,
    start: &[Field<f64, D, D>],
) -> Result<usize, AverageError> {
    let Some(first) = start.first() else {
        return Ok(0);
    };
    let wrong = |what| Err(AverageError::Start { what });
    if start.len() != n_shapes {
        return wrong("there are more or fewer");
    }
    if start.iter().any(|u| u.grid() != first.grid()) {
        return wrong("they lie on several grids");
    }
    let finite = |u: &Field<f64, D, D>| u.as_slice().iter().all(|x| x.is_finite());
    if !start.iter().all(finite) {
        return wrong("not all are finite");
    }
    match grids.iter().position(|grid| grid == first.grid()) {
        Some(level) => Ok(level),
        None => wrong("they lie on another grid"),
    }
}

compiled_once! {
    /// Computes the average of shapes whose phase fields and indicators are given on every level,
    /// coarsest first; the signed distances are those on the finest level and are used to measure
    /// the result.
    ///
    /// The interface width and the coarsest level in the parameters are not used.
    ///
    /// # Errors
    /// Those of [`average`], and [`AverageError::Levels`] where the levels do not fit each other or
    /// the signed distances.
    pub fn average_on_levels<'a, D>(
        signed_distances: &'a [Field<f64, D, 1>],
        levels: Vec<LevelShapes<D>>,
        params: &'a AverageParams,
        observer: &'a mut dyn Observer,
    ) -> Result<AverageResult<D>, AverageError> = average_on_levels_in;
}

fn average_on_levels_in<const D: usize>(
    signed_distances: &[Field<f64, D, 1>],
    levels: Vec<LevelShapes<D>>,
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    let start = Instant::now();
    let first = check(signed_distances, params)?;
    let mut finer = Some(*first.grid());
    for (level, shapes) in levels.iter().enumerate().rev() {
        if Some(*shapes.grid()) != finer || shapes.n_shapes() != signed_distances.len() {
            return Err(AverageError::Levels { level });
        }
        finer = shapes.grid().coarser();
    }
    if levels.is_empty() {
        return Err(AverageError::Levels { level: 0 });
    }
    let found = solve(signed_distances, levels, &[], params, start, observer);
    of_first(found?)
}

compiled_once! {
    /// Computes the deformation of a new shape onto a fixed average: minimises the two terms of
    /// that shape in the functional over its deformation.
    ///
    /// The shape is given by its signed distance; the average by its signed distance, from which
    /// the phase fields on coarse levels are computed, and by its phase field on the finest. The
    /// shape has weight one, so its deformation is the one that it would have as one of the shapes
    /// of the average, if these have equal weights.
    ///
    /// # Errors
    /// As [`average`]; all fields have to lie on one grid.
    pub fn match_to<'a, D>(
        signed_distance: &'a Field<f64, D, 1>,
        target: &'a Field<f64, D, 1>,
        target_phase_field: &'a Field<f64, D, 1>,
        params: &'a AverageParams,
        observer: &'a mut dyn Observer,
    ) -> Result<AverageResult<D>, AverageError> = match_to_in;
}

fn match_to_in<const D: usize>(
    signed_distance: &Field<f64, D, 1>,
    target: &Field<f64, D, 1>,
    target_phase_field: &Field<f64, D, 1>,
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    let params = AverageParams {
        weights: None,
        mean: Mean::Arithmetic,
        ..params.clone()
    };
    let shape = std::slice::from_ref(signed_distance);
    check(&[signed_distance.clone(), target.clone()], &params)?;
    if target_phase_field.grid() != signed_distance.grid() {
        return Err(AverageError::GridsDiffer { index: 1 });
    }
    let start = Instant::now();
    let levels = levels_of(shape, &params)?;
    let mut targets = targets_of(target, &params)?;
    if let Some(finest) = targets.last_mut() {
        *finest = target_phase_field.as_slice().to_vec();
    }
    let problem = Levels::new(levels, &params).onto(targets).estimated();
    of_first(solve_levels(problem, observer)?.into_result(shape, start)?)
}

/// Checks all inputs and returns the first shape.
fn check<'a, const D: usize>(
    signed_distances: &'a [Field<f64, D, 1>],
    params: &AverageParams,
) -> Result<&'a Field<f64, D, 1>, AverageError> {
    let first = signed_distances.first().ok_or(AverageError::NoShapes)?;
    params.check(signed_distances.len())?;
    params.law.compile::<D>()?;
    for (index, shape) in signed_distances.iter().enumerate() {
        if shape.grid() != first.grid() {
            return Err(AverageError::GridsDiffer { index });
        }
        if let Some(node) = shape.as_slice().iter().position(|u| !u.is_finite()) {
            return Err(AverageError::NotFinite { index, node });
        }
        let inside = shape.as_slice().iter().filter(|&&u| u > 0.0).count();
        if inside == 0 || inside == shape.as_slice().len() {
            let what = if inside == 0 { "empty" } else { "full" };
            return Err(AverageError::Degenerate { index, what });
        }
    }
    Ok(first)
}

/// Checks the visibility masks: none, or one per shape on the shapes' grid, with values between 0
/// and 1, not all zero.
fn check_visibility<const D: usize>(
    signed_distances: &[Field<f64, D, 1>],
    seen: &[Field<f64, D, 1>],
) -> Result<(), AverageError> {
    if !seen.is_empty() && seen.len() != signed_distances.len() {
        return Err(AverageError::Masked {
            index: seen.len().min(signed_distances.len()),
            what: "missing, or one too many",
        });
    }
    let wrong = |weight: &Field<f64, D, 1>| {
        let values = weight.as_slice();
        if weight.grid() != signed_distances[0].grid() {
            Some("on another grid than the shapes")
        } else if !values.iter().all(|w| (0.0..=1.0).contains(w)) {
            Some("not between 0 and 1")
        } else if values.iter().all(|&w| w == 0.0) {
            Some("zero everywhere")
        } else {
            None
        }
    };
    let mut all = seen.iter().enumerate();
    match all.find_map(|(index, weight)| wrong(weight).map(|what| (index, what))) {
        Some((index, what)) => Err(AverageError::Masked { index, what }),
        None => Ok(()),
    }
}

fn solve<const D: usize>(
    signed_distances: &[Field<f64, D, 1>],
    levels: Vec<LevelShapes<D>>,
    known: &[Field<f64, D, D>],
    params: &AverageParams,
    start: Instant,
    observer: &mut dyn Observer,
) -> Result<Option<AverageResult<D>>, AverageError> {
    if params.mean != Mean::Arithmetic {
        return crate::median::solve(signed_distances, levels, known, params, start, observer);
    }
    let known = known.iter().map(Field::as_slice).collect();
    let problem = Levels::new(levels, params).from(known).estimated();
    solve_levels(problem, observer)?.into_result(signed_distances, start)
}
