//! Shapes of weight zero: they do not influence the average, and are deformed onto it afterwards.
//!
//! At weight zero the elastic energy of these shapes does not enter the functional. Minimised
//! together with the others, their deformations would be arbitrary, folded up to the bound on the
//! determinant, and their mismatch would attract the average until they have reached it. Therefore
//! the other shapes are averaged alone, with the same weight of a mismatch.
//!
//! A shape of small weight has a small mismatch and, among the deformations with that mismatch, the
//! least elastic energy. Its deformation at weight zero is the limit. It is found by continuation:
//! the shape is deformed onto the average with a large elastic weight, which leads around folds, and
//! from there on the finest level with smaller and smaller ones.

use crate::collect::of_first;
use crate::energy::Energy;
use crate::error::AverageError;
use crate::hierarchy::{LevelMinimiser, Levels, levels_of_visible, targets_of};
use crate::level::LevelShapes;
use crate::params::{AverageParams, Mean};
use crate::result::{AverageResult, Turned};
use crate::shapes::{OwnShapes, Shapes};
use fe_grid::minimise::{Observer, Status, minimise_levels};
use fe_grid::{Buffer, Distribution, Field, ScalarField, mutant};
use std::time::Instant;

/// Elastic weights of the continuation, relative to the full weight of the mismatch of the shape. From
/// each to the next the elastic energy of a bent bar on a straight one grows by 5 to 9 %, as its
/// mismatch falls.
const ELASTIC_WEIGHTS: [f64; 4] = [1.0, 0.2, 0.04, 0.01];

/// The shapes of positive weight, with the parameters of their average.
pub(crate) struct Leaders<const D: usize> {
    /// Signed distances.
    pub shapes: OwnShapes<D>,
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
        shapes: Shapes<'_, D>,
        seen: &[Field<f64, D, 1>],
        known: &[Field<f64, D, D>],
        params: &AverageParams,
    ) -> Self {
        let n = shapes.len();
        let weights = params.resolved_weights(n);
        let leaders = leaders_of(&weights);
        let seen = leaders.iter().filter_map(|&i| seen.get(i));
        // Displacements that are not one per shape are passed on unchanged, so that the error is
        // reported.
        let known = if known.len() == n {
            leaders.iter().map(|&i| known[i].clone()).collect()
        } else {
            known.to_vec()
        };
        Self {
            shapes: shapes.select(leaders.iter().copied(), Field::clone),
            seen: seen.cloned().collect(),
            known,
            params: AverageParams {
                weights: Some(leaders.iter().map(|&i| weights[i]).collect()),
                mismatch_weight: params.mismatch_weight * leaders.len() as f64
                    / mutant!(n, FollowersPull => leaders.len()) as f64,
                length_weight: Some(params.resolved_length_weight()),
                ..params.clone()
            },
        }
    }
}

/// The shapes whose weight is not zero.
fn leaders_of(weights: &[f64]) -> Vec<usize> {
    (0..weights.len()).filter(|&i| weights[i] > 0.0).collect()
}

/// Adds the shapes of weight zero to the average of the others.
///
/// # Errors
/// Those of [`average`](crate::average).
pub(crate) fn with_followers<const D: usize>(
    result: AverageResult<D>,
    shapes: Shapes<'_, D>,
    seen: &[Field<f64, D, 1>],
    params: &AverageParams,
    start: Instant,
    observer: &mut dyn Observer,
) -> Result<AverageResult<D>, AverageError> {
    let n = shapes.len();
    let weights = params.resolved_weights(n);
    let leads = |i: usize| weights[i] > 0.0;
    let grid = *result.average.grid();
    let on_grid = |d: &ScalarField<f64, D>| ScalarField::from_fn(grid, |x| d.sample(x));
    let seen: Vec<_> = seen.iter().map(on_grid).collect();
    let target = Goal::of(&result)?;
    let stopped = result
        .levels
        .last()
        .is_some_and(|level| level.status == Status::Cancelled);
    let mut x = Vec::with_capacity(n * D * grid.n_nodes());
    let mut followed = Vec::new();
    let mut led = result.displacements.iter();
    for i in 0..n {
        if leads(i) {
            x.extend(led.next().into_iter().flat_map(Field::as_slice));
            continue;
        }
        let seen = seen.get(i).map_or(&[][..], std::slice::from_ref);
        let (displacement, terms) = if stopped {
            (vec![0.0; D * grid.n_nodes()], Vec::new())
        } else {
            let own = shapes.select([i], on_grid);
            follow(own.as_shapes(), seen, &target, params, observer)?
        };
        x.extend(displacement);
        followed.push((i, terms));
    }
    let average = result.all_averages();
    let leaders = leaders_of(&weights);
    let turned = result.turned.iter().map(|turned| Turned {
        shape: leaders[turned.shape],
        ..*turned
    });
    let turned: Vec<_> = turned.collect();
    let mut levels = result.levels;
    for (depth, level) in levels.iter_mut().rev().enumerate() {
        for (i, terms) in &followed {
            let of_level = terms
                .len()
                .checked_sub(depth + 1)
                .map(|place| &terms[place]);
            insert(&mut level.energy, *i, of_level);
        }
    }
    let own = shapes.select(0..n, on_grid);
    let level = LevelShapes::of_shapes(grid, own.as_shapes(), params)?.with_visibility(seen);
    let x = Buffer::from(x);
    let result = of_first(AverageResult::new(
        own.as_shapes(),
        &weights,
        level,
        x,
        average,
        levels,
        start,
    )?)?;
    Ok(AverageResult { turned, ..result })
}

/// Inserts the terms of a shape, given by the energy of this shape alone, among those of others.
fn insert(energy: &mut Energy, place: usize, own: Option<&Energy>) {
    let first = |terms: &[f64]| terms.first().copied().unwrap_or(0.0);
    let of = |terms: fn(&Energy) -> &[f64]| own.map_or(0.0, |own| first(terms(own)));
    energy.elastic.insert(place, of(|own| &own.elastic));
    energy.mismatch.insert(place, of(|own| &own.mismatch));
    for (c, terms) in energy.components.iter_mut().enumerate() {
        let own = own.and_then(|own| own.components.get(c));
        let mismatch = own.map_or(0.0, |own| first(&own.mismatch));
        terms.mismatch.insert(place, mismatch);
    }
}

/// What a shape is deformed onto.
struct Goal<const D: usize> {
    /// Signed distances of the whole average and of its components, for the coarser levels.
    wholes: Vec<ScalarField<f64, D>>,
    components: Vec<ScalarField<f64, D>>,
    /// Phase fields of the finest level, one after the other.
    phase_fields: Vec<f64>,
}

impl<const D: usize> Goal<D> {
    fn of(result: &AverageResult<D>) -> Result<Self, AverageError> {
        let distance = |indicator| levelset::signed_distance(indicator, 0.5);
        let parts = result.components.iter().map(|c| &c.average_indicator);
        Ok(Self {
            wholes: vec![distance(&result.average_indicator)?],
            components: parts.map(distance).collect::<Result<_, _>>()?,
            phase_fields: result.all_averages(),
        })
    }

    fn shape(&self) -> Result<Shapes<'_, D>, AverageError> {
        match self.components.len() {
            0 => Ok(Shapes::new(&self.wholes)),
            n => Shapes::of_components(&self.wholes, &self.components, n),
        }
    }
}

/// Computes the displacement that deforms a shape, with its visibility mask if it has one, onto an
/// average; with its energy on every level, coarsest first.
fn follow<const D: usize>(
    shape: Shapes<'_, D>,
    seen: &[ScalarField<f64, D>],
    goal: &Goal<D>,
    params: &AverageParams,
    observer: &mut dyn Observer,
) -> Result<(Vec<f64>, Vec<Energy>), AverageError> {
    let size = D * shape.whole()[0].grid().n_nodes();
    let quiet = &mut crate::quiet::Quiet(observer);
    let alone = Distribution::alone(1);
    let mut terms: Vec<Energy> = Vec::new();
    let mut displacement: Option<Vec<f64>> = None;
    for weight in ELASTIC_WEIGHTS {
        let own = AverageParams {
            weights: Some(vec![weight]),
            mean: Mean::Arithmetic,
            ..params.clone()
        };
        let mut levels = levels_of_visible(shape, seen, &own, &alone)?;
        let mut targets = targets_of(goal.shape()?, &own)?;
        if let Some(finest) = targets.last_mut() {
            finest.clone_from(&goal.phase_fields);
        }
        let start = if let Some(known) = displacement.take() {
            // The continuation stays on the finest level.
            levels.drain(..levels.len() - 1);
            targets.drain(..targets.len() - 1);
            terms.pop();
            known
        } else {
            vec![0.0; D * levels[0].grid().n_nodes()]
        };
        let finest = levels.len() - 1;
        let mut problem = Levels::new(levels, &own).onto(targets);
        let minimiser = |level| LevelMinimiser {
            params: own.clone(),
            finest: level == finest,
            estimated: false,
            onto: true,
            second: None,
        };
        let solution = minimise_levels(&mut problem, minimiser, start, quiet)?;
        // A cancelled run ends on a coarser grid: the shape is then not deformed.
        if solution.x.len() != size {
            return Ok((vec![0.0; size], Vec::new()));
        }
        terms.extend(problem.reports.into_iter().map(|report| report.energy));
        displacement = Some(solution.x.to_vec());
    }
    Ok((displacement.unwrap_or_else(|| vec![0.0; size]), terms))
}
