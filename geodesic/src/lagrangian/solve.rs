//! Solution from one step on the coarsest grid to all steps on the finest.

use super::objective::PathObjective;
use super::search::Search;
use super::starts::refine_time;
use super::steps::{Between, evenly, in_steps};
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::levels::{Level, LevelReport, PathForm, PathOnLevel};
use crate::overlap::{End, carried_overlaps};
use crate::params::GeodesicParams;
use crate::shape::{Shape, check_known};
use crate::transport::Targets;
use fe_grid::Field;
use fe_grid::minimise::Observer;
use fe_grid::transfer::prolong_into;
use fe_grid::{compiled_once, mutant};
use serde::{Deserialize, Serialize};

/// The shape on whose domain the deformations of a path are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Domain {
    /// The start shape.
    #[default]
    Start,
    /// The end shape: the path is computed from the end to the start, with the law of the inverse
    /// deformations, `sum_k int W_inv(Dchi_k) = sum_k int W(Dphi_k)` for `phi_k = chi_k^{-1}`.
    End,
    /// A shape between both: all shapes of the path are deformations of it, and both ends are matched. What opens
    /// on the way from either end to the other is half open there.
    Middle,
}

impl Domain {
    /// Orders the shapes at both ends: first the one whose domain it is, or the start.
    pub fn order<T>(self, start: T, end: T) -> [T; 2] {
        match self {
            Self::Start | Self::Middle => [start, end],
            Self::End => [end, start],
        }
    }
}

/// A minimal path on the finest level, or on the level where the observer cancelled, with the
/// number of steps of that level.
#[derive(Clone, Debug)]
pub struct LagrangianPath<const D: usize> {
    /// The domain of the deformations.
    pub domain: Domain,
    /// The shape of the domain, where that is none of the ends.
    pub middle: Option<Shape<D>>,
    /// Displacements of the deformations of that domain's shape into the 1st, ..., K-th shape, from
    /// there to the other end; of a shape between both into all shapes, from the start on.
    pub displacements: Vec<Field<f64, D, D>>,
    /// Convergence history of each level: all levels on which both domains were tried, that of a turned path, those of
    /// paths to targets ([`LevelReport::targets`]), and those on which the best one was continued; with a larger weight of the mismatch
    /// where it did not reach the other end.
    pub levels: Vec<LevelReport>,
}

compiled_once! {
    /// Computes the shortest path between two shapes given by their signed distances (positive
    /// inside) on one grid.
    ///
    /// The same path can be described on the domain of either shape. Both are minimised on coarse
    /// grids from the identity, and the better one also from rotations of the shape after which it looks more like
    /// the other one. Another start is the path whose last deformation is attracted to the targets of the
    /// optimal transport of the shape's volume to that of the other one, on the domain on which it has less energy; if
    /// none reaches the other end, a viscous flow is one more start of both domains. What reaches the other end, or else
    /// has the least energy, is continued to the finest grid. If a part of one shape is hidden, the path is computed on the
    /// domain of the other, which is deformed with what is hidden there. If it does not reach the other end there, the
    /// weight of the mismatch is doubled, six times at most: the length is that of the least of these weights at which the
    /// path arrives.
    ///
    /// # Errors
    /// [`GeodesicError`] for parameters out of range and unsuitable shapes.
    pub fn lagrangian_path<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<LagrangianPath<D>, GeodesicError> = lagrangian_path_in;
}

compiled_once! {
    /// Computes the path on the domain of a shape between both, from a path of level sets on a coarse grid, if it arrives
    /// with less than a given dissipation, and else the reports of its levels.
    pub(crate) fn lagrangian_path_below<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        dissipation: f64,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Result<LagrangianPath<D>, Vec<LevelReport>>, GeodesicError> = lagrangian_path_below_in;
}

fn lagrangian_path_below_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    dissipation: f64,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Result<LagrangianPath<D>, Vec<LevelReport>>, GeodesicError> {
    Search::new(start, end, params).path_below(dissipation, observer)
}

compiled_once! {
    /// Computes the shortest path from the second shape of a path to its first, which is minimised
    /// from the path itself, on its domain.
    ///
    /// Both paths have the same limit of small steps: on one domain, the deformations of the one
    /// are those of the other in reverse order, with the inverse law. The weight of the mismatch is the
    /// last of the given path, or a larger one.
    ///
    /// `None` if the law has no inverse model, or if the path was computed with other steps or on
    /// another grid than that of the shapes.
    ///
    /// # Errors
    /// As for [`lagrangian_path`].
    pub fn lagrangian_path_back<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        path: &'a LagrangianPath<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Option<LagrangianPath<D>>, GeodesicError> = lagrangian_path_back_in;
}

compiled_once! {
    /// Computes the minimal path from given deformations: displacements of `psi_1, ..., psi_K` on one of the
    /// grids of the hierarchy ([`Grid::hierarchy`], from `coarsest_nodes` on), from which the path is continued
    /// to the finest one, on the domain of the start shape. Deformations that fold are made admissible first.
    ///
    /// # Errors
    /// As for [`lagrangian_path`], and [`GeodesicError::Given`] for another number of deformations or another
    /// grid.
    pub fn lagrangian_path_from<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        first: &'a [Field<f64, D, D>],
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<LagrangianPath<D>, GeodesicError> = lagrangian_path_from_in;
}

/// Checks the parameters, and that both shapes lie on one grid.
fn check<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
) -> Result<(), GeodesicError> {
    params.check()?;
    check_known(start, end, 1)?;
    if start.grid() == end.grid() {
        Ok(())
    } else {
        Err(GeodesicError::GridsDiffer)
    }
}

fn lagrangian_path_from_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    first: &[Field<f64, D, D>],
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<LagrangianPath<D>, GeodesicError> {
    check(start, end, params)?;
    let mut search = Search::new(start, end, params);
    let all = search.coarse.drain(..).chain(search.fine.drain(..));
    let levels: Vec<Level<D>> = all.filter(|l| l.steps == params.steps).collect();
    let given = |level: &Level<D>| {
        first.len() == params.steps && first.iter().all(|u| *u.grid() == level.grid)
    };
    let Some(begin) = levels.iter().position(given) else {
        return Err(GeodesicError::Given);
    };
    let x = first.iter().flat_map(Field::as_slice).copied();
    let from = PathOnLevel::new(levels[begin], x.collect());
    search.fine = levels[begin..].to_vec();
    let found = search.minimise(Domain::Start, from, &levels[begin..], 1.0, observer)?;
    search.in_rounds(found, 1.0, observer)
}

fn lagrangian_path_back_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    path: &LagrangianPath<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Option<LagrangianPath<D>>, GeodesicError> {
    check(start, end, params)?;
    let level = level_of_shapes(start, params);
    let count = level.steps + usize::from(path.domain == Domain::Middle);
    let on_level = path.displacements.len() == count
        && path.displacements.iter().all(|u| *u.grid() == level.grid);
    let last = path.levels.last().filter(|_| on_level);
    let Some(last) = last else {
        return Ok(None);
    };
    if path.domain != Domain::Middle && params.law.law.inverted().is_none() {
        return Ok(None);
    }
    let usual = params.resolved_mismatch_weight() * weight_on(path.domain);
    let factor = last.mismatch_weight / usual;
    let domain = match path.domain {
        Domain::Start => Domain::End,
        Domain::End => Domain::Start,
        Domain::Middle => Domain::Middle,
    };
    let mut displacements: Vec<_> = path.displacements.iter().collect();
    if domain == Domain::Middle {
        displacements.reverse();
    }
    let x = displacements.into_iter().flat_map(Field::as_slice).copied();
    let mut search = Search::on_one_level(end, start, params, level);
    search.middle.clone_from(&path.middle);
    let from = PathOnLevel::new(level, x.collect());
    let found = search.minimise(domain, from, &[level], factor, observer)?;
    search.in_rounds(found, factor, observer).map(Some)
}

/// The level on the grid of the shapes.
fn level_of_shapes<const D: usize>(start: &Shape<D>, params: &GeodesicParams) -> Level<D> {
    Level {
        grid: *start.grid(),
        steps: params.steps,
        tolerance: 1.0,
    }
}

/// Minimises a path of one domain on the grid of the shapes, from displacements of all shapes one after the other, with
/// a factor of the weight of the mismatch.
pub(crate) fn lagrangian_path_on<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    domain: Domain,
    x: Vec<f64>,
    factor: f64,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<LagrangianPath<D>, GeodesicError> {
    let level = level_of_shapes(start, params);
    let mut search = Search::on_one_level(start, end, params, level);
    let from = PathOnLevel::new(level, x);
    let found = search.minimise(domain, from, &[level], factor, observer)?;
    Ok(LagrangianPath {
        domain,
        middle: None,
        displacements: displacements(&found.path)?,
        levels: search.reports,
    })
}

fn lagrangian_path_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<LagrangianPath<D>, GeodesicError> {
    check(start, end, params)?;
    Search::new(start, end, params).path(observer)
}

/// A path of any number of steps, on the grid of the shapes.
pub(crate) struct KnownPath<'a, const D: usize> {
    pub domain: Domain,
    /// The shape of the domain, where that is none of the ends.
    pub middle: Option<&'a Shape<D>>,
    /// Displacements of the deformations of the domain's shape, as those of [`LagrangianPath`].
    pub motions: &'a [Field<f64, D, D>],
    /// Where among these the deformations of the steps lie; at equal times by default.
    pub times: Option<Vec<Between>>,
    /// The weight of the mismatch that it was minimised with.
    pub mismatch_weight: f64,
}

/// Minimises a path of one domain from a path of any number of steps.
pub(crate) fn lagrangian_path_near<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    known: KnownPath<'_, D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<LagrangianPath<D>, GeodesicError> {
    let level = level_of_shapes(start, params);
    let KnownPath {
        domain,
        middle,
        motions,
        times,
        mismatch_weight: weight,
    } = known;
    let own = middle.unwrap_or(domain.order(start, end)[0]).union();
    let held = domain != Domain::Middle;
    let known_steps = motions.len() - usize::from(!held);
    let times = times.unwrap_or_else(|| evenly(known_steps, params.steps, held));
    let x = in_steps(&own, motions, &times, held, &on_domain(params, domain, 1.0))?;
    let weight = mutant!(weight, NearWeight => weight / 3.0);
    let factor = weight / (params.resolved_mismatch_weight() * weight_on(domain));
    let mut search = Search::on_one_level(start, end, params, level);
    search.middle = middle.cloned();
    let from = PathOnLevel::new(level, x);
    let found = search.minimise(domain, from, &[level], factor, observer)?;
    search.in_rounds(found, factor, observer)
}

/// The weight of a mismatch on a domain, relative to that of the single one on the domain of an end. Where both ends are
/// matched, each lags behind by half as much with twice the weight: the length is that of a path that lags at one end.
pub(crate) fn weight_on(domain: Domain) -> f64 {
    match domain {
        Domain::Start | Domain::End => 1.0,
        Domain::Middle => mutant!(2.0, MiddleWeight => 1.0),
    }
}

/// Returns the parameters of the energy on a domain, with a factor of the weight of the mismatch.
pub(super) fn on_domain(params: &GeodesicParams, domain: Domain, factor: f64) -> GeodesicParams {
    let mut own = match domain {
        Domain::Start | Domain::Middle => params.clone(),
        Domain::End => params.inverted(),
    };
    own.mismatch_weight *= factor * weight_on(domain);
    own
}

/// Paths as displacements of the domain of a shape, one after the other.
pub(super) struct Deformations<'a, const D: usize> {
    /// The shape of the domain.
    pub own: &'a Shape<D>,
    /// What the first deformation carries it to, where that is not the identity.
    pub start: Option<&'a Shape<D>>,
    /// What the last deformation carries it to.
    pub end: &'a Shape<D>,
    /// What the shape is attracted to in place of the end shape.
    pub targets: Option<&'a Targets<D>>,
}

impl<const D: usize> PathForm<D> for Deformations<'_, D> {
    type Objective = PathObjective<D>;

    fn objective(
        &self,
        level: &Level<D>,
        params: &GeodesicParams,
    ) -> Result<PathObjective<D>, GeodesicError> {
        let [own, end] = [self.own, self.end].map(|shape| shape.on_grid(&level.grid));
        let objective = match self.start {
            Some(start) => {
                let ends = [start.on_grid(&level.grid), end];
                PathObjective::from_between(own, ends, level.steps, params)?
            }
            None => PathObjective::between(own, end, level.steps, params)?,
        };
        Ok(match self.targets {
            Some(targets) => objective.towards(targets.clone()),
            None => objective,
        })
    }

    fn transfer(
        &self,
        x: &[f64],
        from: &Level<D>,
        to: &Level<D>,
    ) -> Result<Vec<f64>, GeodesicError> {
        let (coarse, fine) = (D * from.grid.n_nodes(), D * to.grid.n_nodes());
        if from.steps != to.steps {
            let held = self.start.is_none();
            return Ok(refine_time(x, coarse, [from.steps, to.steps], held));
        }
        let mut finer = vec![0.0; x.len() / coarse * fine];
        for (out, u) in finer.chunks_exact_mut(fine).zip(x.chunks_exact(coarse)) {
            prolong_into(&from.grid, u, out);
        }
        Ok(finer)
    }

    fn repair(&self, _level: &Level<D>, objective: &PathObjective<D>, x: &mut [f64]) {
        objective.repair(x);
    }

    fn energy(objective: &PathObjective<D>) -> &PathEnergy {
        objective.energy()
    }
}

/// Returns the displacements of a path.
pub(super) fn displacements<const D: usize>(
    path: &PathOnLevel<D>,
) -> Result<Vec<Field<f64, D, D>>, GeodesicError> {
    let grid = path.level.grid;
    let parts = path.x.chunks_exact(D * grid.n_nodes());
    Ok(parts
        .map(|u| Field::from_vec(grid, u.to_vec()))
        .collect::<Result<_, _>>()?)
}

/// Returns how a path ends: at the other end, or the worse of both where neither is its domain.
pub(super) fn end_of<const D: usize>(
    form: &Deformations<'_, D>,
    path: &PathOnLevel<D>,
) -> Result<End, GeodesicError> {
    let grid = path.level.grid;
    let dim = D * grid.n_nodes();
    let at = |to: &Shape<D>, u: &[f64]| {
        let deformation = Field::from_vec(grid, u.to_vec())?;
        Ok::<_, GeodesicError>(carried_overlaps(form.own, to, &deformation)?.end())
    };
    let end = at(form.end, &path.x[path.x.len() - dim..])?;
    Ok(match form.start {
        Some(start) => end.and(at(start, &path.x[..dim])?),
        None => end,
    })
}
