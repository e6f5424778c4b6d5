//! The search for the valley of the shortest path on coarse grids, and the minimisation from there.

use super::solve::{Deformations, Domain, LagrangianPath, displacements, end_of, on_domain};
use super::starts::{along_flow, along_level_sets, along_turn, most_nodes, time_schedule};
use crate::error::GeodesicError;
use crate::levels::{Descent, Level, LevelReport, Numbered, PathOnLevel};
use crate::overlap::End;
use crate::params::{DomainChoice, GeodesicParams};
use crate::shape::Shape;
use crate::transport::{Targets, transport};
use fe_grid::minimise::{Observer, Status};
use levelset::Turn;

/// Factor of the tolerance on all levels but the finest, and the least tolerance there: their paths are starts only.
const COARSE_TOLERANCE: f64 = 20.0;
const LEAST_COARSE_TOLERANCE: f64 = 2e-3;
/// Paths whose energies on a coarse grid differ by less than this share are in the same valley.
const SAME_VALLEY: f64 = 0.02;
/// Largest 95th percentile of the distances of both boundaries, in cells, where a path to targets ends near the other
/// shape.
const NEAR_TARGETS: f64 = 3.0;
/// Least overlap there with a shape of which a part is hidden.
const OVERLAP_OF_VISIBLE: f64 = 0.8;
/// Most rotations of the shape as a whole to begin with.
const TURNS: usize = 3;
/// The path from one is continued to finer grids if its energy on the coarsest is at most this multiple of the least there.
const PROMISING_TURN: f64 = 1.15;
/// It is taken if its energy is less than these multiples of that of the best other one: on the last coarse grid, where what
/// tells paths in different valleys apart by less than a tenth is often the grid, and on the next one.
const CLEARLY_LESS: [f64; 2] = [0.9, 0.95];
/// The other one is minimised on the finest grid, too, if its energy on the next is less than this multiple.
const STILL_A_RIVAL: f64 = 1.5;
/// A round has to reduce the distance from the other end by this factor for another one to follow.
const LEAST_PROGRESS: f64 = 0.9;
/// Factor of the weight of the mismatch from round to round.
const GROWTH: f64 = 2.0;
/// Largest factor: that of the sixth round.
const LARGEST_FACTOR: f64 = 64.0;
/// A path on the domain of a shape between both is continued to fine grids if its dissipation on a coarse one is less than
/// this multiple of that of the path that is known on the finest.
const PROMISING: f64 = 1.3;
/// Factor of the tolerance in all rounds: only the path at the last weight is minimised to the end.
const ROUND_TOLERANCE: f64 = 10.0;

/// A path on a coarse grid.
pub(super) struct Candidate<const D: usize> {
    domain: Domain,
    pub path: PathOnLevel<D>,
    end: End,
    /// The place of the report of its last level.
    report: usize,
}

impl<const D: usize> Candidate<D> {
    /// How far a path gets: further ones are greater.
    fn rank(&self) -> (bool, bool) {
        (self.end.reached(), self.end.near())
    }

    /// Whether it gets further than another path, or has less than this multiple of its energy.
    fn is_better(&self, other: &Self, share: f64) -> bool {
        let order = self.rank().cmp(&other.rank());
        let least = share * other.path.total;
        order.then(least.total_cmp(&self.path.total)).is_gt()
    }

    /// The better one of two paths: the one that gets further, or else has less energy.
    fn or(self, other: Self) -> Self {
        if other.is_better(&self, 1.0) {
            other
        } else {
            self
        }
    }
}

/// A level as it is for paths of which one is chosen, or that are starts of others.
fn coarsely<const D: usize>(level: &Level<D>) -> Level<D> {
    Level {
        tolerance: ROUND_TOLERANCE * level.tolerance,
        ..*level
    }
}

/// The search for the best start, and the minimisation from there.
pub(super) struct Search<'a, const D: usize> {
    start: &'a Shape<D>,
    end: &'a Shape<D>,
    params: &'a GeodesicParams,
    /// The levels on which both domains are tried, and those after them.
    pub coarse: Vec<Level<D>>,
    pub fine: Vec<Level<D>>,
    /// The shape between both, once it is used.
    pub middle: Option<Shape<D>>,
    pub reports: Vec<LevelReport>,
}

impl<'a, const D: usize> Search<'a, D> {
    pub fn new(start: &'a Shape<D>, end: &'a Shape<D>, params: &'a GeodesicParams) -> Self {
        let grids = start.grid().hierarchy(params.coarsest_nodes);
        let schedule = time_schedule(params.steps);
        let tolerance = COARSE_TOLERANCE.max(LEAST_COARSE_TOLERANCE / params.tolerance);
        let level = |grid, steps| Level {
            grid,
            steps,
            tolerance,
        };
        let mut coarse: Vec<_> = schedule.iter().map(|&k| level(grids[0], k)).collect();
        coarse.extend(grids[1..].iter().map(|&grid| level(grid, params.steps)));
        let finest = Level {
            tolerance: 1.0,
            ..coarse[coarse.len() - 1]
        };
        // Both domains are tried up to the first grid that resolves shapes well enough, but not on the finest one unless
        // it is the only one.
        let tried = grids[..grids.len() - 1]
            .iter()
            .position(|grid| most_nodes(grid) >= params.flow_nodes)
            .unwrap_or(grids.len().saturating_sub(2));
        let mut fine = coarse.split_off(schedule.len() + tried);
        // Where there is one grid only, both are tried on it, roughly.
        fine.pop();
        fine.push(finest);
        Self {
            start,
            end,
            params,
            coarse,
            fine,
            middle: None,
            reports: Vec::new(),
        }
    }

    /// The search from a path that is known on one level.
    pub fn on_one_level(
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
            middle: None,
            reports: Vec::new(),
        }
    }

    /// The domains on which the path is tried. Laws without an inverse model know the start's only. A shape
    /// of which a part is hidden lacks it under all deformations; one that is visible everywhere is deformed
    /// into the other with what is hidden there.
    fn domains(&self) -> &'static [Domain] {
        let invertible = self.params.law.law.inverted().is_some();
        match self.params.domain {
            DomainChoice::Better | DomainChoice::Ends if invertible => {
                match (self.start.hidden(), self.end.hidden()) {
                    (true, false) => &[Domain::End],
                    (false, true) => &[Domain::Start],
                    _ => &[Domain::Start, Domain::End],
                }
            }
            DomainChoice::End if invertible => &[Domain::End],
            DomainChoice::Middle => &[Domain::Middle],
            _ => &[Domain::Start],
        }
    }

    /// The shortest path.
    pub fn path(mut self, observer: &mut dyn Observer) -> Result<LagrangianPath<D>, GeodesicError> {
        let domains = self.domains();
        if domains == [Domain::Middle] {
            let found = match self.start_at_level_sets(observer)? {
                Some(found) => found,
                // Cancelled before there was a shape between both: a path that has only begun.
                None if self.ended() => self.start_at_identity(Domain::Start, observer)?,
                None => return Err(GeodesicError::Middle),
            };
            return self.finish(found, observer);
        }
        let mut found = self.start_at_identity(domains[0], observer)?;
        for &domain in &domains[1..] {
            if !self.ended() {
                found = found.or(self.start_at_identity(domain, observer)?);
            }
        }
        let mut as_it_is = None;
        if let Some(turned) = self.turned_path(&found, observer)? {
            as_it_is = Some(std::mem::replace(&mut found, turned));
        }
        if let Some(towards) = self.path_to_targets(observer)? {
            found = self.or_from_targets(found, towards, observer)?;
        }
        if !self.ended() && !found.end.reached() {
            for &domain in domains {
                if let Some(other) = self.start_at_flow(domain, observer)? {
                    found = found.or(other);
                }
            }
        }
        let mut rival = None;
        if let Some(other) = as_it_is {
            (found, rival) = self.better_on_next(found, other, observer)?;
        }
        if let Some(rival) = rival {
            found = self.better_on_finest(found, rival, observer)?;
        }
        self.finish(found, observer)
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

    /// The path whose last deformation is attracted to the targets of the shape's volume, on the domain on which it has
    /// less energy; none for shapes of which parts of both are hidden, or that have many points on all coarse grids.
    fn path_to_targets(
        &mut self,
        observer: &mut dyn Observer,
    ) -> Result<Option<Candidate<D>>, GeodesicError> {
        let last = self.coarse[self.coarse.len() - 1];
        if self.ended() || self.start.hidden() && self.end.hidden() {
            return Ok(None);
        }
        let grids: Vec<_> = self.coarse.iter().map(|level| level.grid).collect();
        let Some(targets) = transport(self.start, self.end, &grids) else {
            return Ok(None);
        };
        let steps = time_schedule(last.steps).into_iter();
        let levels: Vec<_> = steps.map(|steps| Level { steps, ..last }).collect();
        let mut found: Option<Candidate<D>> = None;
        for &domain in self.domains() {
            if self.ended() {
                break;
            }
            let [own, _] = domain.order(&targets[0], &targets[1]);
            let identity = vec![0.0; levels[0].steps * D * last.grid.n_nodes()];
            let start = PathOnLevel::new(levels[0], identity);
            let path = self.minimise_towards(domain, start, &levels, own, observer)?;
            if found
                .as_ref()
                .is_none_or(|found| path.total < found.path.total)
            {
                found = Some(self.candidate(domain, path)?);
            }
        }
        Ok(found)
    }

    /// The better one of the best path from the identity and that from a path to targets, which is computed only if it
    /// ends near the other shape with less energy: very different shapes have no transport that a deformation follows.
    fn or_from_targets(
        &mut self,
        found: Candidate<D>,
        towards: Candidate<D>,
        observer: &mut dyn Observer,
    ) -> Result<Candidate<D>, GeodesicError> {
        let longer = found.end.reached() && towards.path.total >= self.dissipation_of(&found);
        let is_near = match &towards.end.arrival {
            Some(end) => end.percentile_95 <= NEAR_TARGETS,
            None => towards.end.dice >= OVERLAP_OF_VISIBLE,
        };
        if self.ended() || longer || !is_near {
            return Ok(found);
        }
        let Candidate { domain, path, .. } = towards;
        let level = path.level;
        let other = self.minimise(domain, path, &[level], 1.0, observer)?;
        // From the identity, paths are smooth from the beginning; from elsewhere in the same valley, they need more
        // iterations.
        let better = other.is_better(&found, 1.0 - SAME_VALLEY);
        Ok(if better { other } else { found })
    }

    /// The best path from a rotation of the shape as a whole after which it looks more like the other end than after others
    /// nearby, if it is clearly better than the best path so far. Most are given up on the coarsest grid.
    fn turned_path(
        &mut self,
        found: &Candidate<D>,
        observer: &mut dyn Observer,
    ) -> Result<Option<Candidate<D>>, GeodesicError> {
        let domain = found.domain;
        let [from, to] = domain.order(self.start, self.end);
        if self.ended() || from.hidden() || to.hidden() {
            return Ok(None);
        }
        let mut turned: Option<Candidate<D>> = None;
        let turns = Turn::several(&from.union(), &to.union(), TURNS);
        let (coarsest, others) = self.coarse.split_at(time_schedule(self.params.steps).len());
        let (first, others) = (coarsest[coarsest.len() - 1], others.to_vec());
        let known = self.least_on(&first);
        for turn in turns {
            if self.ended() {
                break;
            }
            let start = PathOnLevel::new(first, along_turn(&turn, first.grid, first.steps));
            let other = self.minimise(domain, start, &[first], 1.0, observer)?;
            if other.path.total > PROMISING_TURN * known {
                continue;
            }
            let other = self.minimise(domain, other.path, &others, 1.0, observer)?;
            turned = Some(match turned {
                Some(turned) => turned.or(other),
                None => other,
            });
        }
        Ok(turned.filter(|turned| turned.is_better(found, CLEARLY_LESS[0])))
    }

    /// The first one of two paths, if it is clearly better on the next finer grid, too, and else the other one; with the
    /// other one in the first case, if it may become better on finer grids.
    fn better_on_next(
        &mut self,
        found: Candidate<D>,
        other: Candidate<D>,
        observer: &mut dyn Observer,
    ) -> Result<(Candidate<D>, Option<Candidate<D>>), GeodesicError> {
        let Some(next) = self.fine.first().map(coarsely).filter(|_| !self.ended()) else {
            return Ok((found, None));
        };
        let mut on_next = |path: Candidate<D>| {
            self.minimise(path.domain, path.path, &[next], 1.0, &mut *observer)
        };
        let [found, other] = [on_next(found)?, on_next(other)?];
        if !self.ended() && !found.is_better(&other, CLEARLY_LESS[1]) {
            return Ok((other, None));
        }
        let is_rival = other.path.total < STILL_A_RIVAL * found.path.total;
        Ok((found, Some(other).filter(|_| is_rival)))
    }

    /// The better one of two paths on the finest grid.
    fn better_on_finest(
        &mut self,
        found: Candidate<D>,
        rival: Candidate<D>,
        observer: &mut dyn Observer,
    ) -> Result<Candidate<D>, GeodesicError> {
        if self.ended() {
            return Ok(found);
        }
        let levels = std::mem::take(&mut self.fine);
        let rival = self.minimise(rival.domain, rival.path, &levels, 1.0, observer)?;
        if self.ended() {
            return Ok(found);
        }
        let found = self.minimise(found.domain, found.path, &levels, 1.0, observer)?;
        Ok(if self.ended() { found } else { found.or(rival) })
    }

    /// The least energy of a path that was minimised on a level.
    fn least_on(&self, level: &Level<D>) -> f64 {
        let nodes = level.grid.nodes_per_axis();
        let same = |report: &&LevelReport| report.nodes == nodes && report.steps == level.steps;
        let energies = self.reports.iter().filter(same).map(|r| r.energy.total);
        energies.fold(f64::INFINITY, f64::min)
    }

    /// The minimal path on the last of the coarse levels from a path of level sets, on the domain of the shape in its
    /// middle.
    fn start_at_level_sets(
        &mut self,
        observer: &mut dyn Observer,
    ) -> Result<Option<Candidate<D>>, GeodesicError> {
        let last = self.coarse[self.coarse.len() - 1];
        if self.start.hidden() || self.end.hidden() {
            return Ok(None);
        }
        let mut numbered = Numbered {
            first: self.reports.len(),
            n_levels: None,
            observer: &mut *observer,
        };
        let ends = [self.start, self.end];
        let (found, levels) = along_level_sets(ends, &last.grid, self.params, &mut numbered)?;
        self.reports.extend(levels);
        let Some((middle, motions)) = found.filter(|_| !self.ended()) else {
            return Ok(None);
        };
        self.middle = Some(middle);
        let start = PathOnLevel::new(last, motions);
        let found = self.minimise(Domain::Middle, start, &[last], 1.0, observer)?;
        Ok(Some(found))
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

    /// The path on the domain of a shape between both, if it arrives with less than this dissipation. It is given up on
    /// the coarse grid where it has not much less there, and on the finest one where a first pass does not arrive; then
    /// there are only the reports of its levels.
    pub fn path_below(
        mut self,
        dissipation: f64,
        observer: &mut dyn Observer,
    ) -> Result<Result<LagrangianPath<D>, Vec<LevelReport>>, GeodesicError> {
        let found = self.start_at_level_sets(observer)?;
        let is_less = |found: &Candidate<D>| {
            self.fine.is_empty() || self.dissipation_of(found) < PROMISING * dissipation
        };
        let Some(found) = found.filter(is_less) else {
            return Ok(Err(self.reports));
        };
        let levels = std::mem::take(&mut self.fine);
        let first: Vec<_> = levels.iter().map(coarsely).collect();
        let mut found = self.minimise(Domain::Middle, found.path, &first, 1.0, observer)?;
        if self.ended() || !found.end.reached() {
            return Ok(Err(self.reports));
        }
        if let Some(&last) = levels.last() {
            found = self.minimise(Domain::Middle, found.path, &[last], 1.0, observer)?;
        }
        self.in_rounds(found, 1.0, observer).map(Ok)
    }

    /// The dissipation of a path that was minimised.
    fn dissipation_of(&self, path: &Candidate<D>) -> f64 {
        let report = self.reports.get(path.report);
        report.map_or(f64::INFINITY, |report| report.energy.dissipation())
    }

    /// Continues a path to the finest level, and there with a growing weight of the mismatch until
    /// it reaches the other end.
    fn finish(
        mut self,
        best: Candidate<D>,
        observer: &mut dyn Observer,
    ) -> Result<LagrangianPath<D>, GeodesicError> {
        let levels = std::mem::take(&mut self.fine);
        let cancelled = self.ended();
        if (levels.is_empty() || cancelled) && best.report < self.reports.len() {
            // The last report is that of the path, also where no other level follows.
            self.reports[best.report..].rotate_left(1);
            if let Some(last) = self.reports.last_mut().filter(|_| cancelled) {
                last.info.status = Status::Cancelled;
            }
        }
        let Candidate { domain, path, .. } = best;
        let found = self.minimise(domain, path, &levels, 1.0, observer)?;
        self.in_rounds(found, 1.0, observer)
    }

    /// Continues a path that was minimised with a factor of the weight of the mismatch with larger
    /// ones, until it reaches the other end.
    pub fn in_rounds(
        mut self,
        mut found: Candidate<D>,
        mut factor: f64,
        observer: &mut dyn Observer,
    ) -> Result<LagrangianPath<D>, GeodesicError> {
        let (first, level) = (factor, found.path.level);
        while factor < LARGEST_FACTOR && !found.end.reached() && !self.ended() {
            let gap = found.end.gap;
            factor *= GROWTH;
            found = self.minimise(
                found.domain,
                found.path,
                &[coarsely(&level)],
                factor,
                observer,
            )?;
            if found.end.gap > LEAST_PROGRESS * gap {
                break;
            }
        }
        if factor > first && !self.ended() {
            found = self.minimise(found.domain, found.path, &[level], factor, observer)?;
        }
        Ok(LagrangianPath {
            domain: found.domain,
            middle: self.middle.filter(|_| found.domain == Domain::Middle),
            displacements: displacements(&found.path)?,
            levels: self.reports,
        })
    }

    /// Minimises on some levels, with a factor of the weight of the mismatch; returns the path as it is if a level before has been cancelled.
    pub fn minimise(
        &mut self,
        domain: Domain,
        start: PathOnLevel<D>,
        levels: &[Level<D>],
        factor: f64,
        observer: &mut dyn Observer,
    ) -> Result<Candidate<D>, GeodesicError> {
        let params = on_domain(self.params, domain, factor);
        let path = self.descend(domain, start, levels, &params, None, observer)?;
        self.candidate(domain, path)
    }

    /// A path that was minimised last, with its end.
    fn candidate(
        &self,
        domain: Domain,
        path: PathOnLevel<D>,
    ) -> Result<Candidate<D>, GeodesicError> {
        Ok(Candidate {
            end: end_of(&self.form(domain, None), &path)?,
            domain,
            path,
            report: self.reports.len().saturating_sub(1),
        })
    }

    /// Minimises on some levels with the attraction of the shape's points to targets in place of the mismatch.
    fn minimise_towards(
        &mut self,
        domain: Domain,
        start: PathOnLevel<D>,
        levels: &[Level<D>],
        targets: &Targets<D>,
        observer: &mut dyn Observer,
    ) -> Result<PathOnLevel<D>, GeodesicError> {
        let params = on_domain(self.params, domain, 1.0);
        let before = self.reports.len();
        let path = self.descend(domain, start, levels, &params, Some(targets), observer)?;
        for report in &mut self.reports[before..] {
            report.targets = true;
        }
        Ok(path)
    }

    fn descend(
        &mut self,
        domain: Domain,
        start: PathOnLevel<D>,
        levels: &[Level<D>],
        params: &GeodesicParams,
        targets: Option<&Targets<D>>,
        observer: &mut dyn Observer,
    ) -> Result<PathOnLevel<D>, GeodesicError> {
        let reports = std::mem::take(&mut self.reports);
        let mut descent = Descent {
            form: self.form(domain, targets),
            params,
            n_levels: self.n_levels().max(reports.len() + 1),
            levels: Vec::new(),
            reports,
        };
        let path = descent.minimise(start, levels, observer)?;
        self.reports = descent.reports;
        Ok(path)
    }

    /// The deformations of a domain.
    fn form<'b>(&'b self, domain: Domain, targets: Option<&'b Targets<D>>) -> Deformations<'b, D> {
        let [from, end] = domain.order(self.start, self.end);
        let middle = self.middle.as_ref().filter(|_| domain == Domain::Middle);
        Deformations {
            own: middle.unwrap_or(from),
            start: middle.map(|_| from),
            end,
            targets,
        }
    }

    /// Number of levels without those of turned paths and of flows, for the display of progress.
    fn n_levels(&self) -> usize {
        let towards = time_schedule(self.params.steps).len();
        let coarse = self.domains().len() * (self.coarse.len() + towards) + 1;
        (coarse + self.fine.len()).max(self.reports.len() + 1)
    }
}
