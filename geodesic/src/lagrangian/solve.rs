//! Solution from one step on the coarsest grid to all steps on the finest.

use super::objective::PathObjective;
use super::starts::{along_flow, most_nodes, points_inside, refine_time, time_schedule};
use crate::energy::PathEnergy;
use crate::error::GeodesicError;
use crate::levels::{Descent, Level, LevelReport, PathForm, PathOnLevel};
use crate::overlap::{End, Overlaps, carried_overlaps};
use crate::params::{DomainChoice, GeodesicParams};
use crate::shape::{Shape, check_known};
use crate::transport::along_transport;
use fe_grid::Field;
use fe_grid::compiled_once;
use fe_grid::minimise::{Observer, Status};
use fe_grid::transfer::prolong_into;
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
}

impl Domain {
    /// Orders the shapes at both ends: first the one whose domain it is.
    pub fn order<T>(self, start: T, end: T) -> [T; 2] {
        match self {
            Self::Start => [start, end],
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
    /// Displacements of the deformations of that domain's shape into the 1st, ..., K-th shape, from
    /// there to the other end.
    pub displacements: Vec<Field<f64, D, D>>,
    /// Convergence history of each level: all levels on which both domains were tried, and those on
    /// which the better one was continued; with a larger weight of the mismatch where it did not
    /// reach the other end.
    pub levels: Vec<LevelReport>,
}

compiled_once! {
    /// Computes the shortest path between two shapes given by their signed distances (positive
    /// inside) on one grid.
    ///
    /// The same path can be described on the domain of either shape. Both are minimised on coarse
    /// grids from the identity and from the optimal transport of the shape's volume to that of the other one; if
    /// none reaches the other end, a viscous flow is a third start of both. What reaches the other end, or else has
    /// the least energy, is continued to the finest grid. If a part of one shape is hidden, the path is computed on the domain of the other,
    /// which is deformed with what is hidden there. If it does not reach the other end there, the weight of the mismatch is doubled, six
    /// times at most: the length is that of the least of these weights at which the path arrives.
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
    let on_level = path.displacements.len() == level.steps
        && path.displacements.iter().all(|u| *u.grid() == level.grid);
    let last = path.levels.last().filter(|_| on_level);
    let (Some(last), Some(_)) = (last, params.law.law.inverted()) else {
        return Ok(None);
    };
    let factor = last.mismatch_weight / params.resolved_mismatch_weight();
    let domain = match path.domain {
        Domain::Start => Domain::End,
        Domain::End => Domain::Start,
    };
    let x = path.displacements.iter().flat_map(Field::as_slice).copied();
    let mut search = Search::on_one_level(end, start, params, level);
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
        displacements: displacements(&found.path)?,
        levels: search.reports,
    })
}

/// Factor of the tolerance on all levels but the finest: their paths are starts only.
const COARSE_TOLERANCE: f64 = 20.0;

fn lagrangian_path_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<LagrangianPath<D>, GeodesicError> {
    check(start, end, params)?;
    let mut search = Search::new(start, end, params);
    let mut found = Vec::new();
    for &domain in search.domains() {
        found.push(search.start_at_identity(domain, observer)?);
    }
    for &domain in search.domains() {
        found.extend(search.start_at_transport(domain, observer)?);
    }
    if !search.ended() && found.iter().all(|candidate| !candidate.end.reached()) {
        for &domain in search.domains() {
            found.extend(search.start_at_flow(domain, observer)?);
        }
    }
    let rank = |found: &Candidate<D>| (found.end.reached(), found.end.near());
    let mut best = 0;
    for other in 1..found.len() {
        // From the identity, paths are smooth from the beginning; from elsewhere in the same valley, they need more
        // iterations.
        let least = if other < search.domains().len() {
            found[best].path.total
        } else {
            (1.0 - SAME_VALLEY) * found[best].path.total
        };
        let order = rank(&found[other]).cmp(&rank(&found[best]));
        if order
            .then(least.total_cmp(&found[other].path.total))
            .is_gt()
        {
            best = other;
        }
    }
    search.finish(found.swap_remove(best), observer)
}

/// Paths whose energies on a coarse grid differ by less than this share are in the same valley.
const SAME_VALLEY: f64 = 0.02;
/// Most points of a shape whose volume is transported to find a start.
const TRANSPORTED: usize = 600;
/// A round has to reduce the distance from the other end by this factor for another one to follow.
const LEAST_PROGRESS: f64 = 0.9;
/// Factor of the weight of the mismatch from round to round.
const GROWTH: f64 = 2.0;
/// Largest factor: that of the sixth round.
const LARGEST_FACTOR: f64 = 64.0;
/// Factor of the tolerance in all rounds: only the path at the last weight is minimised to the end.
const ROUND_TOLERANCE: f64 = 10.0;

/// A path on a coarse grid.
struct Candidate<const D: usize> {
    domain: Domain,
    path: PathOnLevel<D>,
    end: End,
    /// The place of the report of its last level.
    report: usize,
}

/// The search for the best start, and the minimisation from there.
struct Search<'a, const D: usize> {
    start: &'a Shape<D>,
    end: &'a Shape<D>,
    params: &'a GeodesicParams,
    /// The levels on which both domains are tried, and those after them.
    coarse: Vec<Level<D>>,
    fine: Vec<Level<D>>,
    /// The levels of paths that start at a transport, up to the last of the coarse ones; none for shapes of which a
    /// part is hidden.
    transported: Vec<Level<D>>,
    reports: Vec<LevelReport>,
}

impl<'a, const D: usize> Search<'a, D> {
    fn new(start: &'a Shape<D>, end: &'a Shape<D>, params: &'a GeodesicParams) -> Self {
        let grids = start.grid().hierarchy(params.coarsest_nodes);
        let schedule = time_schedule(params.steps);
        let level = |grid, steps| Level {
            grid,
            steps,
            tolerance: COARSE_TOLERANCE,
        };
        let mut coarse: Vec<_> = schedule.iter().map(|&k| level(grids[0], k)).collect();
        coarse.extend(grids[1..].iter().map(|&grid| level(grid, params.steps)));
        if let Some(finest) = coarse.last_mut() {
            finest.tolerance = 1.0;
        }
        // Both domains are tried up to the first grid that flows are computed on, but not on the
        // finest one unless it is the only one.
        let tried = grids[..grids.len() - 1]
            .iter()
            .rposition(|grid| most_nodes(grid) <= params.flow_nodes)
            .unwrap_or(0);
        let fine = coarse.split_off(schedule.len() + tried);
        let transported = if start.hidden() || end.hidden() {
            Vec::new()
        } else {
            let grids = &coarse[schedule.len() - 1..];
            // The finest grid with few points, as the cost grows with the square of their number.
            let few = |level: &Level<D>| {
                let points = [start, end].map(|shape| points_inside(shape, &level.grid));
                points.iter().all(|points| *points <= TRANSPORTED)
            };
            let first = grids.iter().rposition(few).unwrap_or(0);
            let levels = schedule.iter().map(|&steps| Level {
                steps,
                ..grids[first]
            });
            levels.chain(grids[first + 1..].iter().copied()).collect()
        };
        Self {
            start,
            end,
            params,
            coarse,
            fine,
            transported,
            reports: Vec::new(),
        }
    }

    /// The search from a path that is known on one level.
    fn on_one_level(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        level: Level<D>,
    ) -> Self {
        Self {
            start,
            end,
            params,
            coarse: Vec::new(),
            fine: vec![level],
            transported: Vec::new(),
            reports: Vec::new(),
        }
    }

    /// The domains on which the path is tried. Laws without an inverse model know the start's only. A shape
    /// of which a part is hidden lacks it under all deformations; one that is visible everywhere is deformed
    /// into the other with what is hidden there.
    fn domains(&self) -> &'static [Domain] {
        let invertible = self.params.law.law.inverted().is_some();
        match self.params.domain {
            DomainChoice::Better if invertible => match (self.start.hidden(), self.end.hidden()) {
                (true, false) => &[Domain::End],
                (false, true) => &[Domain::Start],
                _ => &[Domain::Start, Domain::End],
            },
            DomainChoice::End if invertible => &[Domain::End],
            _ => &[Domain::Start],
        }
    }

    fn ended(&self) -> bool {
        let status = self.reports.last().map(|report| report.info.status);
        matches!(status, Some(Status::Cancelled))
    }

    /// The minimal path on the coarse levels from the identity.
    fn start_at_identity(
        &mut self,
        domain: Domain,
        observer: &mut dyn Observer,
    ) -> Result<Candidate<D>, GeodesicError> {
        let first = self.coarse[0];
        let identity = vec![0.0; first.steps * D * first.grid.n_nodes()];
        let levels = self.coarse.clone();
        let start = PathOnLevel::new(first, identity);
        self.minimise(domain, start, &levels, 1.0, observer)
    }

    /// The minimal path on the coarse levels from a transport of the shape's volume, for shapes that are visible
    /// everywhere.
    fn start_at_transport(
        &mut self,
        domain: Domain,
        observer: &mut dyn Observer,
    ) -> Result<Option<Candidate<D>>, GeodesicError> {
        let levels = self.transported.clone();
        let Some(first) = levels.first().filter(|_| !self.ended()) else {
            return Ok(None);
        };
        let [from, to] = domain.order(self.start, self.end);
        let transport = along_transport(from, to, &first.grid);
        let start = PathOnLevel::new(*first, transport);
        Ok(Some(self.minimise(domain, start, &levels, 1.0, observer)?))
    }

    /// The minimal path on the last of the coarse levels from a viscous flow, for shapes that are
    /// visible everywhere.
    fn start_at_flow(
        &mut self,
        domain: Domain,
        observer: &mut dyn Observer,
    ) -> Result<Option<Candidate<D>>, GeodesicError> {
        let level = self.coarse[self.coarse.len() - 1];
        let [from, to] = domain.order(self.start, self.end);
        if self.fine.is_empty() || self.ended() || from.hidden() || to.hidden() {
            return Ok(None);
        }
        let flow = along_flow(from, to, &level.grid, self.params, observer)?;
        let start = PathOnLevel::new(level, flow);
        Ok(Some(self.minimise(
            domain,
            start,
            &[level],
            1.0,
            observer,
        )?))
    }

    /// Continues a path to the finest level, and there with a growing weight of the mismatch until
    /// it reaches the other end.
    fn finish(
        mut self,
        best: Candidate<D>,
        observer: &mut dyn Observer,
    ) -> Result<LagrangianPath<D>, GeodesicError> {
        let levels = std::mem::take(&mut self.fine);
        if levels.is_empty() && best.report < self.reports.len() {
            // The last report is that of the path, also where no other level follows.
            self.reports[best.report..].rotate_left(1);
        }
        let Candidate { domain, path, .. } = best;
        let found = self.minimise(domain, path, &levels, 1.0, observer)?;
        self.in_rounds(found, 1.0, observer)
    }

    /// Continues a path that was minimised with a factor of the weight of the mismatch with larger
    /// ones, until it reaches the other end.
    fn in_rounds(
        mut self,
        mut found: Candidate<D>,
        mut factor: f64,
        observer: &mut dyn Observer,
    ) -> Result<LagrangianPath<D>, GeodesicError> {
        let (first, level) = (factor, found.path.level);
        let coarsely = Level {
            tolerance: ROUND_TOLERANCE * level.tolerance,
            ..level
        };
        while factor < LARGEST_FACTOR && !found.end.reached() && !self.ended() {
            let gap = found.end.gap;
            factor *= GROWTH;
            found = self.minimise(found.domain, found.path, &[coarsely], factor, observer)?;
            if found.end.gap > LEAST_PROGRESS * gap {
                break;
            }
        }
        if factor > first && !self.ended() {
            found = self.minimise(found.domain, found.path, &[level], factor, observer)?;
        }
        Ok(LagrangianPath {
            domain: found.domain,
            displacements: displacements(&found.path)?,
            levels: self.reports,
        })
    }

    /// Minimises on some levels, with a factor of the weight of the mismatch; returns the path as it is if a level before has been cancelled.
    fn minimise(
        &mut self,
        domain: Domain,
        start: PathOnLevel<D>,
        levels: &[Level<D>],
        factor: f64,
        observer: &mut dyn Observer,
    ) -> Result<Candidate<D>, GeodesicError> {
        let [from, to] = domain.order(self.start, self.end);
        let params = on_domain(self.params, domain, factor);
        let mut descent = Descent {
            form: Deformations {
                start: from,
                end: to,
            },
            params: &params,
            n_levels: self.n_levels(),
            levels: Vec::new(),
            reports: std::mem::take(&mut self.reports),
        };
        let path = descent.minimise(start, levels, observer)?;
        self.reports = descent.reports;
        let overlaps = overlaps_of(from, to, &path)?;
        Ok(Candidate {
            domain,
            path,
            end: overlaps.end(),
            report: self.reports.len().saturating_sub(1),
        })
    }

    /// Number of levels without flows, for the display of progress.
    fn n_levels(&self) -> usize {
        let coarse = self.domains().len() * (self.coarse.len() + self.transported.len());
        (coarse + self.fine.len()).max(self.reports.len() + 1)
    }
}

/// Returns the parameters of the energy on a domain, with a factor of the weight of the mismatch.
pub(super) fn on_domain(params: &GeodesicParams, domain: Domain, factor: f64) -> GeodesicParams {
    let mut own = match domain {
        Domain::Start => params.clone(),
        Domain::End => params.inverted(),
    };
    own.mismatch_weight *= factor;
    own
}

/// Paths as displacements of a start domain, one after the other.
struct Deformations<'a, const D: usize> {
    start: &'a Shape<D>,
    end: &'a Shape<D>,
}

impl<const D: usize> PathForm<D> for Deformations<'_, D> {
    type Objective = PathObjective<D>;

    fn objective(
        &self,
        level: &Level<D>,
        params: &GeodesicParams,
    ) -> Result<PathObjective<D>, GeodesicError> {
        let [first, last] = [self.start, self.end].map(|shape| shape.on_grid(&level.grid));
        PathObjective::between(first, last, level.steps, params)
    }

    fn transfer(
        &self,
        x: &[f64],
        from: &Level<D>,
        to: &Level<D>,
    ) -> Result<Vec<f64>, GeodesicError> {
        let (coarse, fine) = (D * from.grid.n_nodes(), D * to.grid.n_nodes());
        if from.steps != to.steps {
            return Ok(refine_time(x, coarse, from.steps, to.steps));
        }
        let mut finer = vec![0.0; to.steps * fine];
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
fn displacements<const D: usize>(
    path: &PathOnLevel<D>,
) -> Result<Vec<Field<f64, D, D>>, GeodesicError> {
    let grid = path.level.grid;
    let parts = path.x.chunks_exact(D * grid.n_nodes());
    Ok(parts
        .map(|u| Field::from_vec(grid, u.to_vec()))
        .collect::<Result<_, _>>()?)
}

/// Returns the overlaps that the last deformation of a path achieves.
fn overlaps_of<const D: usize>(
    from: &Shape<D>,
    to: &Shape<D>,
    path: &PathOnLevel<D>,
) -> Result<Overlaps, GeodesicError> {
    let grid = path.level.grid;
    let last = &path.x[(path.level.steps - 1) * D * grid.n_nodes()..];
    let last = Field::from_vec(grid, last.to_vec())?;
    carried_overlaps(from, to, &last)
}
