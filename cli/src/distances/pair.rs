//! The paths from one shape to another: their computation, storage and selection.

use ::geodesic::{
    Arrival, Form, Geodesic, GeodesicError, GeodesicParams, Shape, geodesic_between, geodesic_near,
    geodesics_both_ways, geodesics_through,
};
use serde::{Deserialize, Serialize};

use super::args::DistancesConfig;
use crate::interrupt::Interrupt;
use crate::report::overall;

/// A pair of shapes whose paths are to be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct Way {
    /// The numbers of the shapes, in the order of the first direction.
    pub ids: [usize; 2],
    /// The shape through which the way leads that the paths are minimised from, if they are not computed anew.
    pub detour: Option<Detour>,
}

/// A shape between those of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct Detour {
    pub through: usize,
    /// How often the spacing of the grid is halved.
    pub refinements: u32,
}

/// Start and end of a path, and the shape through which the way leads that it was minimised from.
pub(super) type Key = ([usize; 2], Option<usize>);

impl Way {
    /// The paths of the pair, in so many directions.
    pub fn keys(&self, directions: usize) -> impl Iterator<Item = Key> + use<> {
        let through = self.detour.map(|detour| detour.through);
        let [i, j] = self.ids;
        [[i, j], [j, i]]
            .into_iter()
            .take(directions)
            .map(move |ids| (ids, through))
    }

    /// The pair itself.
    pub fn direct(ids: [usize; 2]) -> Self {
        Self { ids, detour: None }
    }
}

/// The stored paths from one shape to another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PairRecord {
    pub start: usize,
    pub end: usize,
    /// The factor from the common scale of all shapes to the scale of the pair in the box.
    pub magnification: f64,
    /// How often the spacing of the grid was halved for this pair.
    #[serde(default)]
    pub refinements: u32,
    /// The shape through which the way leads that the paths were minimised from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub through: Option<usize>,
    /// All attempts on that grid, in the order of their computation.
    pub paths: Vec<PathRecord>,
}

/// One path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PathRecord {
    pub form: Form,
    pub steps: usize,
    /// `sum sqrt W_k`; `None` if it is not finite.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// `K sum W_k`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dissipation: Option<f64>,
    /// Overlap of the end shape and the deformed start shape.
    pub dice_end: f64,
    /// Mean distance of the boundaries at the end, in spacings; `None` if it is not finite.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap_end: Option<f64>,
    /// How closely the boundaries agree there; fully visible shapes with boundaries only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arrival: Option<Arrival>,
    /// Merges and splits beyond those in which the ends differ.
    #[serde(default)]
    pub needless_contacts: usize,
    pub end_reached: bool,
    /// Whether it ends so close that its length is of use.
    pub end_near: bool,
    pub certified: bool,
    pub min_det: f64,
    pub status: String,
    pub iterations: usize,
    pub evaluations: usize,
    /// Wall time on one thread, or on several if there are more threads than paths.
    pub seconds: f64,
}

/// Where a pair of shapes is computed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// The numbers of the shapes.
    pub ids: [usize; 2],
    /// The factor from the common scale of all shapes to the scale of the pair in the box.
    pub magnification: f64,
    /// How often the spacing of the grid is halved.
    pub refinements: u32,
    /// The number of a shape between both.
    pub through: Option<usize>,
}

/// A usable length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    pub form: Form,
    /// With the requested number of steps.
    pub length: f64,
    /// With half that number.
    pub half: Option<f64>,
}

impl PathRecord {
    /// The record of a path of a pair that was magnified.
    fn new<const D: usize>(
        form: Form,
        path: &Geodesic<D>,
        magnification: f64,
        seconds: f64,
    ) -> Self {
        let finite = |value: f64| value.is_finite().then_some(value);
        // Energies grow as volumes.
        let unit = magnification.powi(D as i32);
        let levels = &path.levels;
        Self {
            form,
            steps: path.energy.step_energies.len(),
            length: finite(path.length() / unit.sqrt()),
            dissipation: finite(path.dissipation() / unit),
            dice_end: path.dice_end,
            gap_end: finite(path.gap_end),
            arrival: path.arrival.filter(Arrival::has_boundaries),
            needless_contacts: path.needless_contacts,
            end_reached: path.end_reached(),
            end_near: path.end_near(),
            certified: path.certificate.certified,
            min_det: path.certificate.min_det,
            status: overall(path.status, levels.last().map(|l| l.info.status)),
            iterations: levels.iter().map(|l| l.info.iterations).sum(),
            evaluations: levels.iter().map(|l| l.info.evaluations.energies()).sum(),
            seconds,
        }
    }

    /// Whether the path arrives at its end without a fold.
    pub fn sound(&self) -> bool {
        self.end_reached && self.certified && self.length.is_some()
    }

    /// The length, if it is usable.
    pub fn usable(&self, config: &DistancesConfig) -> Option<f64> {
        let reached = config
            .reached
            .map_or(self.end_near, |least| self.dice_end >= least);
        self.length.filter(|_| reached && self.certified)
    }
}

impl PairRecord {
    /// Its shapes, the smaller number first.
    pub fn pair(&self) -> [usize; 2] {
        [self.start.min(self.end), self.start.max(self.end)]
    }

    /// The attempt in a form with this number of steps.
    pub fn path(&self, form: Form, steps: usize) -> Option<&PathRecord> {
        let mut paths = self.paths.iter();
        paths.find(|path| path.form == form && path.steps == steps)
    }

    /// The length of the attempt in a form with this number of steps, if it is usable.
    fn usable(&self, form: Form, steps: usize, config: &DistancesConfig) -> Option<f64> {
        self.path(form, steps)?.usable(config)
    }

    /// The usable paths of these numbers of steps: all of one form, the first for which all are
    /// usable; else of the first form for which the first number is.
    pub fn measured(&self, config: &DistancesConfig, steps: &[usize]) -> Option<Measured> {
        let usable = |form, steps| self.usable(form, steps, config);
        let found: Vec<Measured> = config
            .forms()
            .filter_map(|form| {
                Some(Measured {
                    form,
                    length: usable(form, *steps.first()?)?,
                    half: steps.get(1).and_then(|half| usable(form, *half)),
                })
            })
            .collect();
        let whole = |m: &&Measured| steps.len() < 2 || m.half.is_some();
        found.iter().find(whole).or(found.first()).copied()
    }

    /// Whether the paths of all these numbers of steps are usable in some form.
    fn has(&self, group: &[usize], config: &DistancesConfig) -> bool {
        let usable = |form, steps: &usize| self.usable(form, *steps, config).is_some();
        let mut forms = config.forms();
        forms.any(|form| group.iter().all(|steps| usable(form, steps)))
    }

    /// Whether a path with the number of steps that is asked for arrives without a fold.
    pub fn arrives(&self, config: &DistancesConfig) -> bool {
        let steps = config.params.steps;
        let mut paths = self.paths.iter();
        paths.any(|path| path.steps == steps && path.sound())
    }

    /// Takes the paths of another record in a form in place of those with the same number of steps.
    pub fn replace_by(&mut self, other: &Self, form: Form) {
        let is_left =
            |path: &PathRecord| path.form != form || other.path(form, path.steps).is_none();
        self.paths.retain(is_left);
        self.paths.splice(0..0, other.paths.iter().cloned());
        self.through = other.through;
        self.magnification = other.magnification;
    }

    /// Paths that fold or do not reach their end.
    pub fn faulty(&self) -> impl Iterator<Item = &PathRecord> {
        self.paths.iter().filter(|path| !path.sound())
    }
}

impl Place {
    /// Records without paths, one for every direction.
    pub fn records(&self, directions: usize) -> Vec<PairRecord> {
        let record = |way: usize| PairRecord {
            start: self.ids[way],
            end: self.ids[1 - way],
            magnification: self.magnification,
            refinements: self.refinements,
            through: self.through,
            paths: Vec::new(),
        };
        (0..directions).map(record).collect()
    }
}

/// Computes the paths of a pair that make a distance from the way through a third shape, which is the second one of
/// three. Records without paths where the way does not arrive; `None` if interrupted.
///
/// # Errors
/// [`GeodesicError`] for shapes and parameters that do not fit.
pub(super) fn compute_through<const D: usize>(
    place: Place,
    [first, through, second]: &[Shape<D>; 3],
    config: &DistancesConfig,
    interrupt: &Interrupt,
) -> Result<Option<Vec<PairRecord>>, GeodesicError> {
    let mut observer = interrupt.clone();
    let mut records = place.records(config.directions());
    let mut known: Option<[Geodesic<D>; 2]> = None;
    for steps in config.steps() {
        let params = GeodesicParams {
            steps,
            ..config.params.clone()
        };
        let begin = std::time::Instant::now();
        // Those of fewer steps lie in the same valley.
        let found = match &known {
            None => geodesics_through(first, through, second, &params, &mut observer)?,
            Some([there, back]) => {
                let mut near = |a, b, path| geodesic_near(a, b, path, &params, &mut observer);
                let there = near(first, second, there)?;
                let back = near(second, first, back)?;
                there.zip(back).map(|(there, back)| [there, back])
            }
        };
        if interrupt.asked() {
            return Ok(None);
        }
        let Some(found) = found else {
            break;
        };
        let seconds = begin.elapsed().as_secs_f64() / found.len() as f64;
        for (record, path) in records.iter_mut().zip(&found) {
            let (form, magnification) = (config.params.form, place.magnification);
            let path = PathRecord::new(form, path, magnification, seconds);
            record.paths.push(path);
        }
        known = Some(found);
    }
    Ok(Some(records))
}

/// Computes all paths of a pair, in one direction or in both: those that make a distance, and the one
/// of a single step, whose length is the elastic distance. If one of them is unusable, it is computed
/// in the other form on request. Returns a record for every direction, the first from the first shape
/// to the second, or `None` if interrupted.
///
/// # Errors
/// [`GeodesicError`] for shapes and parameters that do not fit.
pub(super) fn compute<const D: usize>(
    place: Place,
    shapes: &[Shape<D>; 2],
    config: &DistancesConfig,
    interrupt: &Interrupt,
) -> Result<Option<Vec<PairRecord>>, GeodesicError> {
    let magnification = place.magnification;
    let directions = config.directions();
    let mut records = place.records(directions);
    for group in [config.steps(), vec![1]] {
        for form in config.forms() {
            for &steps in &group {
                // A group that is usable in one form is not computed in another.
                let missing: Vec<usize> = (0..directions)
                    .filter(|&way| {
                        let record = &records[way];
                        record.path(form, steps).is_none() && !record.has(&group, config)
                    })
                    .collect();
                if missing.is_empty() {
                    continue;
                }
                let params = GeodesicParams {
                    form,
                    steps,
                    ..config.params.clone()
                };
                let begin = std::time::Instant::now();
                let paths = geodesics(shapes, &missing, &params, interrupt)?;
                if interrupt.asked() {
                    return Ok(None);
                }
                let seconds = begin.elapsed().as_secs_f64() / missing.len() as f64;
                for (way, path) in missing.into_iter().zip(&paths) {
                    let path = PathRecord::new(form, path, magnification, seconds);
                    records[way].paths.push(path);
                }
            }
        }
    }
    Ok(Some(records))
}

/// The geodesics in some directions: 0 from the first shape to the second, 1 back.
fn geodesics<const D: usize>(
    [first, second]: &[Shape<D>; 2],
    ways: &[usize],
    params: &GeodesicParams,
    interrupt: &Interrupt,
) -> Result<Vec<Geodesic<D>>, GeodesicError> {
    let mut observer = interrupt.clone();
    Ok(match ways {
        [_, _] => geodesics_both_ways(first, second, params, &mut observer)?.into(),
        [1] => vec![geodesic_between(second, first, params, &mut observer)?],
        _ => vec![geodesic_between(first, second, params, &mut observer)?],
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn path(form: Form, steps: usize, usable: bool) -> PathRecord {
        PathRecord {
            form,
            steps,
            length: Some(steps as f64 + if form == Form::LevelSets { 0.5 } else { 0.0 }),
            dissipation: None,
            dice_end: if usable { 1.0 } else { 0.8 },
            gap_end: None,
            arrival: None,
            needless_contacts: 0,
            end_reached: usable,
            end_near: usable,
            certified: true,
            min_det: 0.5,
            status: "converged".into(),
            iterations: 1,
            evaluations: 1,
            seconds: 1.0,
        }
    }

    fn config(retry: bool) -> DistancesConfig {
        DistancesConfig {
            retry: retry.then_some(Form::LevelSets),
            richardson: true,
            ..DistancesConfig::default()
        }
    }

    #[test]
    fn lengths_that_are_compared_are_of_one_form() {
        use Form::{Lagrangian, LevelSets};
        let record = |paths| PairRecord {
            start: 0,
            end: 1,
            magnification: 1.0,
            refinements: 0,
            through: None,
            paths,
        };
        let measured = |paths, retry| {
            let found = record(paths).measured(&config(retry), &[4, 2]);
            found.map(|m| (m.form, m.length, m.half))
        };
        let good = vec![path(Lagrangian, 4, true), path(Lagrangian, 2, true)];
        assert_eq!(measured(good, false), Some((Lagrangian, 4.0, Some(2.0))));
        let half = vec![path(Lagrangian, 4, true), path(Lagrangian, 2, false)];
        assert_eq!(measured(half.clone(), false), Some((Lagrangian, 4.0, None)));
        let again = [
            half.clone(),
            vec![path(LevelSets, 4, true), path(LevelSets, 2, true)],
        ]
        .concat();
        assert_eq!(measured(again, true), Some((LevelSets, 4.5, Some(2.5))));
        let neither = [
            half,
            vec![path(LevelSets, 4, false), path(LevelSets, 2, true)],
        ]
        .concat();
        assert_eq!(measured(neither, true), Some((Lagrangian, 4.0, None)));
        assert_eq!(measured(vec![path(Lagrangian, 4, false)], false), None);
        let lower = DistancesConfig {
            reached: Some(0.8),
            ..config(false)
        };
        let short = record(vec![path(Lagrangian, 4, false)]);
        assert!(short.measured(&lower, &[4, 2]).is_some());
        assert_eq!(short.faulty().count(), 1);
    }
}
