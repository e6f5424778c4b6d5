//! Entry points: averages of shapes, and the deformation of a shape onto an average.

use crate::collect::of_first;
use crate::error::AverageError;
use crate::follow::{Leaders, with_followers};
use crate::hierarchy::{Levels, levels_of, levels_of_visible, solve_levels, targets_of};
use crate::level::LevelShapes;
use crate::params::{AverageParams, Mean, Solver};
use crate::rematch::ByOthers;
use crate::result::AverageResult;
use crate::shapes::Shapes;
use crate::turned::{Found, Turnable};
use fe_grid::communicator::{Alone, Communicator};
use fe_grid::minimise::{Observer, together};
use fe_grid::{Distribution, Field, Grid, compiled_once};
use std::sync::Arc;
use std::time::Instant;

/// Computes the average of shapes given by their signed distances (positive inside) on one grid.
///
/// The observer is notified of every level and iteration and may cancel; the result is then the
/// state reached so far, on the grid of the level that was being minimised.
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
    average_of_components(Shapes::new(signed_distances), seen, known, params, observer)
}

/// Computes the average of shapes of one or several components, see [`Shapes`], as [`average_from`] does.
///
/// With several components `c` the functional is
///
/// ```text
/// E = sum_i lambda_i int kappa_i W(D phi_i) + sum_c ( (gamma/n) sum_i F[v^c o phi_i, v_i^c] + mu_L L[v^c] )
/// ```
///
/// with `kappa_i` the elastic weight of the union of a shape's components: one deformation moves all of
/// them, and each has an average of its own. A visibility mask hides parts of all components of a shape.
///
/// # Errors
/// As [`average_from`].
pub fn average_of_components<const D: usize>(
    shapes: Shapes<'_, D>,
    seen: &[Field<f64, D, 1>],
    start: &[Field<f64, D, D>],
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    let alone: Arc<dyn Communicator> = Arc::new(Alone);
    of_first(average_distributed(
        alone, shapes, seen, start, params, observer,
    )?)
}

compiled_once! {
    /// Computes the average, as [`average_of_components`] does, on several processes: each has some of the shapes,
    /// and the first has the result; the others have `None`.
    ///
    /// All processes call this with the same arguments, but for the observer, of which that of the first is
    /// asked. The result has the same bits on any number of processes. Shapes of weight zero are deformed
    /// on the first.
    ///
    /// # Errors
    /// As [`average_of_components`], and [`AverageError::Distributed`] where there are several processes and the
    /// solver is [`Solver::Descent`].
    pub fn average_distributed<'a, D>(
        communicator: Arc<dyn Communicator>,
        shapes: Shapes<'a, D>,
        seen: &'a [Field<f64, D, 1>],
        start: &'a [Field<f64, D, D>],
        params: &'a AverageParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Option<AverageResult<D>>, AverageError> = average_distributed_in;
}

fn average_distributed_in<const D: usize>(
    communicator: Arc<dyn Communicator>,
    shapes: Shapes<'_, D>,
    seen: &[Field<f64, D, 1>],
    known: &[Field<f64, D, D>],
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<Option<AverageResult<D>>, AverageError> {
    check(shapes, params)?;
    let processes = communicator.size();
    if processes > 1 && params.solver == Solver::Descent {
        let what = "gradient descent";
        return Err(AverageError::Distributed { what, processes });
    }
    check_visibility(shapes, seen)?;
    let start = Instant::now();
    let weights = params.resolved_weights(shapes.len());
    if weights.contains(&0.0) {
        let led = Leaders::of(shapes, seen, known, params);
        let found = average_distributed_in(
            communicator,
            led.shapes.as_shapes(),
            &led.seen,
            &led.known,
            &led.params,
            observer,
        )?;
        let follow = |own| with_followers(own, shapes, seen, params, start, observer);
        return found.map(follow).transpose();
    }
    let distribution = Distribution::over(communicator, shapes.len());
    let mut levels = levels_of_visible(shapes, seen, params, &distribution)?;
    let grids: Vec<Grid<D>> = levels.iter().map(|level| *level.grid()).collect();
    let first = first_level(&grids, shapes.len(), known)?;
    let known = known.get(distribution.own()).unwrap_or_default();
    // Only where they are known by these distances alone.
    let rematched = seen.is_empty() && shapes.n_components() == 1;
    together(&distribution, observer, |observer| {
        let turnable = Turnable {
            shapes: shapes.whole(),
            onto: None,
            levels: &levels,
            params,
        };
        let turned = turnable.turned(observer)?;
        levels.drain(..first);
        let result = solve(shapes, levels, known, rematched, params, start, observer)?;
        Ok(result.map(|result| with_turned(result, turned, params)))
    })
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
    let shapes = Shapes::new(signed_distances);
    let mut finer = Some(check(shapes, params)?);
    for (level, own) in levels.iter().enumerate().rev() {
        let fits = own.n_shapes() == shapes.len() && own.n_components() == 1;
        if Some(*own.grid()) != finer || !fits {
            return Err(AverageError::Levels { level });
        }
        finer = own.grid().coarser();
    }
    if levels.is_empty() {
        return Err(AverageError::Levels { level: 0 });
    }
    of_first(solve(shapes, levels, &[], false, params, start, observer)?)
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
    let [shape, target] = [signed_distance, target].map(std::slice::from_ref);
    let phase_field = std::slice::from_ref(target_phase_field);
    let [shape, target] = [shape, target].map(Shapes::new);
    match_components_to(shape, target, phase_field, params, observer)
}

compiled_once! {
    /// Computes the deformation of a new shape of one or several components onto a fixed average, as
    /// [`match_to`] does: `shape` and `target` are one shape each, and `target_phase_fields` are the phase
    /// fields of the average's components.
    ///
    /// # Errors
    /// As [`match_to`], and [`AverageError::Components`] where the shape and the average do not have the same
    /// number of components, or are not one each.
    pub fn match_components_to<'a, D>(
        shape: Shapes<'a, D>,
        target: Shapes<'a, D>,
        target_phase_fields: &'a [Field<f64, D, 1>],
        params: &'a AverageParams,
        observer: &'a mut dyn Observer,
    ) -> Result<AverageResult<D>, AverageError> = match_components_to_in;
}

fn match_components_to_in<const D: usize>(
    shape: Shapes<'_, D>,
    target: Shapes<'_, D>,
    target_phase_fields: &[Field<f64, D, 1>],
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    let params = AverageParams {
        weights: None,
        mean: Mean::Arithmetic,
        ..params.clone()
    };
    let n_components = shape.n_components();
    for (shapes, components) in [
        (shape.len(), n_components),
        (target.len(), target.n_components()),
        (1, target_phase_fields.len()),
    ] {
        if shapes != 1 || components != n_components {
            return Err(AverageError::Components {
                shapes: 1,
                components: n_components,
                found: shapes * components,
            });
        }
    }
    let grid = check(shape, &params)?;
    let same = target.check().map(|other| other == grid);
    let same = same.map_err(|error| error.of_shape(1))?;
    for field in target_phase_fields {
        let wrong = |v: &f64| !v.is_finite();
        if let Some(node) = field.as_slice().iter().position(wrong) {
            return Err(AverageError::NotFinite { index: 1, node });
        }
    }
    if !same || target_phase_fields.iter().any(|v| *v.grid() != grid) {
        return Err(AverageError::GridsDiffer { index: 1 });
    }
    let start = Instant::now();
    let levels = levels_of(shape, &params)?;
    let mut targets = targets_of(target, &params)?;
    if let Some(finest) = targets.last_mut() {
        let fields = target_phase_fields.iter().map(Field::as_slice);
        *finest = fields.collect::<Vec<_>>().concat();
    }
    let turnable = Turnable {
        shapes: shape.whole(),
        onto: Some((&target.whole()[0], &targets)),
        levels: &levels,
        params: &params,
    };
    let turned = turnable.turned(observer)?;
    let problem = Levels::new(levels, &params).onto(targets).estimated();
    let result = of_first(solve_levels(problem, observer)?.into_result(shape, start)?)?;
    Ok(with_turned(result, turned, &params))
}

/// The result with the shapes that still lie turned.
fn with_turned<const D: usize>(
    result: AverageResult<D>,
    found: Option<Found>,
    params: &AverageParams,
) -> AverageResult<D> {
    let turned = found.map(|found| found.beside(&result.energy, params));
    let turned = turned.unwrap_or_default();
    AverageResult { turned, ..result }
}

/// Checks all inputs and returns their grid.
fn check<const D: usize>(
    shapes: Shapes<'_, D>,
    params: &AverageParams,
) -> Result<Grid<D>, AverageError> {
    if shapes.is_empty() {
        return Err(AverageError::NoShapes);
    }
    params.check(shapes.len())?;
    params.law.compile::<D>()?;
    shapes.check()
}

/// Checks the visibility masks: none, or one per shape on the shapes' grid, with values between 0
/// and 1, not all zero.
fn check_visibility<const D: usize>(
    shapes: Shapes<'_, D>,
    seen: &[Field<f64, D, 1>],
) -> Result<(), AverageError> {
    if !seen.is_empty() && seen.len() != shapes.len() {
        return Err(AverageError::Masked {
            index: seen.len().min(shapes.len()),
            what: "missing, or one too many",
        });
    }
    let wrong = |weight: &Field<f64, D, 1>| {
        let values = weight.as_slice();
        if weight.grid() != shapes.whole()[0].grid() {
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
    shapes: Shapes<'_, D>,
    levels: Vec<LevelShapes<D>>,
    known: &[Field<f64, D, D>],
    rematched: bool,
    params: &AverageParams,
    start: Instant,
    observer: &mut dyn Observer,
) -> Result<Option<AverageResult<D>>, AverageError> {
    if params.mean != Mean::Arithmetic {
        return crate::median::solve(shapes, levels, known, params, start, observer);
    }
    let known = known.iter().map(Field::as_slice).collect();
    let mut problem = Levels::new(levels, params).from(known).estimated();
    let others = ByOthers {
        signed_distances: shapes.whole(),
    };
    if rematched {
        problem = problem.again(&others);
    }
    solve_levels(problem, observer)?.into_result(shapes, start)
}
