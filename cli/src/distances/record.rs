//! The contents of `result.json`. Missing values are left out; there are no nulls.

use std::time::Instant;

use ::geodesic::distances::{Linkage, Merge};
use ::geodesic::{Arrival, Form};
use levelset::{Cause, Doubt};
use serde::Serialize;

use super::Outcome;
use super::args::DistancesConfig;
use super::detours::Detours;
use super::map::{LandmarkMap, Map};
use super::neighbours::Neighbours;
use super::pair::{PairRecord, PathRecord};
use super::skip::Skipped;
use super::study::Distances;
use crate::doubts::{DoubtRecord, named};
use crate::report::{self, CONVERGED};
use crate::shapes::{Input, InputRecord, common_scale, doubts_of};

/// The contents of `result.json`; the status is `complete`, or `incomplete` if some pair has no
/// path that reaches its end. The time is that of this run, without paths of earlier runs.
pub(super) type Record<'a, const D: usize> = report::Record<DistancesConfig, Found<'a>, D>;

/// The result.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Found<'a> {
    /// Placement of the pairs: `pairs` if each has its own.
    pub align: &'static str,
    /// From lengths in the unit box to those in the length units of the inputs, where these have
    /// one scale: a length grows as the square root of a volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_unit: Option<f64>,
    /// The part of the pairs that was computed, and the number of parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shard: Option<String>,
    /// Number of new shapes, whose distances to the stored ones after them were computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub new_shapes: Option<usize>,
    /// What was skipped, where far pairs are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skipped: Option<&'a Skipped>,
    /// Paths that were minimised from ways through third shapes.
    #[serde(skip_serializing_if = "Detours::is_none")]
    pub detours: Detours,
    /// Every requested path.
    pub paths: Vec<LengthRecord>,
    /// Attempts that fold or do not reach their end, and their replacements.
    pub marked: Vec<MarkRecord<'a>>,
    /// The symmetric distances: the mean of both directions, extrapolated on request.
    pub distances: &'a Distances,
    /// The same for the elastic distances, the roots of the energies of a single step.
    pub elastic: &'a Distances,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub neighbours: Option<&'a Neighbours>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clustering: Option<ClusteringRecord<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub embedding: Option<EmbeddingRecord<'a>>,
    /// Pairs whose distance is not extrapolated although this was requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_extrapolated: Vec<[usize; 2]>,
    /// For all paths together, of all runs.
    pub path_seconds: f64,
}

/// The usable lengths from one shape to another.
#[derive(Clone, Debug, Serialize)]
pub(super) struct LengthRecord {
    pub start: usize,
    pub end: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub form: Option<Form>,
    /// The factor from the common scale of all shapes to that of the pair in the box. Lengths are
    /// in the common scale.
    pub magnification: f64,
    /// How often the spacing of the grid was halved for the pair.
    pub refinements: u32,
    /// The shape through which the way leads that the path was minimised from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub through: Option<usize>,
    /// `L` with the requested number of steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// With half that number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_length: Option<f64>,
    /// `sqrt W` of a single step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub elastic: Option<f64>,
    /// Overlap with the end shape.
    pub dice_end: f64,
    /// Mean distance of the boundaries there, in spacings of the grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_end: Option<f64>,
    /// How closely the boundaries agree there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arrival: Option<Arrival>,
    /// Merges and splits beyond those in which the ends differ.
    pub needless_contacts: usize,
    /// Lower bound of the determinants.
    pub min_det: f64,
    /// Status of the path that is used.
    pub status: String,
    /// Iterations and evaluations of the energy on all levels of that path.
    pub iterations: usize,
    pub evaluations: usize,
    /// Of all attempts on that grid.
    pub seconds: f64,
}

/// A path that folds or does not reach its end.
#[derive(Clone, Debug, Serialize)]
pub(super) struct MarkRecord<'a> {
    pub start: usize,
    pub end: usize,
    #[serde(flatten)]
    pub path: &'a PathRecord,
    pub outcome: MarkOutcome,
}

/// Treatment of a path that folds or does not reach its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum MarkOutcome {
    /// Its length is not used.
    LeftOut,
    /// Its length is used, as requested.
    Used,
    /// It was replaced by an attempt in the other form.
    Replaced,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct ClusteringRecord<'a> {
    linkage: Linkage,
    /// Clusters below the number of inputs are inputs, others are results of the merge of that
    /// number minus the number of inputs, as in SciPy.
    merges: &'a [Merge],
    /// The order of the inputs in the pictures.
    order: &'a [usize],
    pub clusters: usize,
    /// The cluster of each input.
    labels: &'a [usize],
}

#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub(super) enum EmbeddingRecord<'a> {
    Whole(WholeRecord<'a>),
    Landmarks(&'a LandmarkMap),
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct WholeRecord<'a> {
    /// The points of minimal stress.
    points: &'a [[f64; 2]],
    /// Kruskal's first.
    stress: f64,
    /// The points of classical scaling, the initial guess.
    classical: ClassicalRecord<'a>,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct ClassicalRecord<'a> {
    points: &'a [[f64; 2]],
    stress: f64,
    /// Share of the variance in these two dimensions.
    explained: f64,
    /// Share of the negative eigenvalues: the part that cannot be embedded in any Euclidean space.
    negative: f64,
    eigenvalues: &'a [f64],
}

/// The record of an outcome.
pub(super) fn record<const D: usize>(outcome: &Outcome<D>, start: Instant) -> Record<'_, D> {
    let (inputs, study, config) = (&outcome.inputs, &outcome.study, &outcome.config);
    let records = &outcome.records;
    let distances = &study.distances;
    let marked: Vec<_> = records.iter().flat_map(|r| marks(r, config)).collect();
    // Paths that end near their end are complete, with a doubt.
    let asked = |mark: &MarkRecord<'_>| mark.outcome == MarkOutcome::Used && !mark.path.end_near;
    let used = marked.iter().any(asked);
    let complete = study.complete && !used;
    let scale = common_scale(inputs.iter().map(Input::scale));
    let found = Found {
        align: outcome.align,
        shard: outcome.shard.map(|shard| shard.to_string()),
        new_shapes: (outcome.scope.is_across()).then(|| outcome.scope.rows().len()),
        skipped: outcome.skipped.as_ref(),
        detours: outcome.detours,
        length_unit: scale.map(|scale| scale.powi(D as i32).sqrt().recip()),
        paths: records
            .iter()
            .map(|r| LengthRecord::new(r, config))
            .collect(),
        marked,
        distances,
        elastic: &study.elastic,
        neighbours: study.neighbours.as_ref(),
        clustering: ClusteringRecord::new(config.linkage, &study.distances),
        embedding: study.map.as_ref().map(EmbeddingRecord::new),
        not_extrapolated: study.not_extrapolated.clone(),
        path_seconds: records.iter().map(seconds).sum(),
    };
    let status = match (outcome.shard, complete) {
        (Some(_), _) => "part",
        (None, true) => "complete",
        (None, false) => "incomplete",
    };
    let doubts = doubts(outcome, &found);
    let grid = Some(&outcome.grid);
    let mut record = Record::new(status, grid, config, found, doubts, start).of(inputs_of(outcome));
    if records.iter().any(|r| r.magnification != 1.0) {
        // Each pair has its own.
        record.spacing_input_units = None;
    }
    record
}

/// Subjects of doubts: the inputs by their numbers, and after them pairs.
struct Subjects {
    names: Vec<String>,
}

impl Subjects {
    /// A doubt about a pair of inputs, which is named after both.
    fn of_pair(&mut self, doubt: Doubt, [i, j]: [usize; 2], between: &str) -> Doubt {
        let name = format!("{} {between} {}", self.names[i], self.names[j]);
        if self.names.last() != Some(&name) {
            self.names.push(name);
        }
        doubt.about(self.names.len() - 1)
    }
}

/// The doubts about the inputs, the paths, and the distances.
fn doubts<const D: usize>(outcome: &Outcome<D>, found: &Found<'_>) -> Vec<DoubtRecord> {
    let names = outcome.inputs.iter().map(|input| input.name.clone());
    let mut subjects = Subjects {
        names: names.collect(),
    };
    let counting = |path: &&LengthRecord| path.status != CONVERGED;
    let unfinished = found.paths.iter().filter(counting).count();
    let mut doubts = doubts_of(&outcome.inputs);
    doubts.extend(Doubt::check(Cause::NotConverged, unfinished as f64));
    let left = found.marked.iter();
    for mark in left.filter(|mark| mark.outcome != MarkOutcome::Replaced) {
        let path = mark.path;
        let gap = path.gap_end.unwrap_or(f64::INFINITY);
        let own = [
            Arrival::doubt_of_overlap(path.arrival, path.dice_end, gap),
            Doubt::below(Cause::Determinant, path.min_det, 0.0),
        ];
        let arrival = path.arrival.map(|found| found.doubts());
        for doubt in own
            .into_iter()
            .flatten()
            .chain(arrival.into_iter().flatten())
        {
            doubts.push(subjects.of_pair(doubt, [mark.start, mark.end], "to"));
        }
    }
    for path in &found.paths {
        let contacts = path.needless_contacts as f64;
        if let Some(doubt) = Doubt::check(Cause::NeedlessContacts, contacts) {
            doubts.push(subjects.of_pair(doubt, [path.start, path.end], "to"));
        }
    }
    let distances = found.distances;
    let asymmetry = distances.asymmetry.as_ref();
    for doubt in ::geodesic::distances::doubts(asymmetry, &distances.triangles) {
        let ends = match doubt.cause {
            Cause::Asymmetry => asymmetry.map(|asymmetry| asymmetry.worst),
            _ => distances.triangles.worst_triangle.map(|[i, j, _]| [i, j]),
        };
        doubts.push(match ends {
            Some(ends) => subjects.of_pair(doubt, ends, "and"),
            None => doubt,
        });
    }
    named(&doubts, subjects.names.iter().map(|name| &**name))
}

/// The inputs with their names and classes.
fn inputs_of<const D: usize>(outcome: &Outcome<D>) -> Vec<InputRecord<D>> {
    let labels = outcome.labels.as_ref();
    let inputs = outcome.inputs.iter().enumerate();
    let record = |(i, input): (usize, &Input<D>)| {
        let mut record = InputRecord::new(input);
        record.class = labels.and_then(|labels| Some(labels.name(i)?.to_owned()));
        record
    };
    inputs.map(record).collect()
}

fn seconds(record: &PairRecord) -> f64 {
    record.paths.iter().map(|path| path.seconds).sum()
}

impl LengthRecord {
    fn new(record: &PairRecord, config: &DistancesConfig) -> Self {
        let steps = config.steps();
        let measured = record.measured(config, &steps);
        let form = measured.map_or(config.params.form, |m| m.form);
        // Every pair has at least an attempt in the first form.
        let path = record.path(form, steps[0]);
        Self {
            start: record.start,
            end: record.end,
            magnification: record.magnification,
            refinements: record.refinements,
            through: record.through,
            form: measured.map(|m| m.form),
            length: measured.map(|m| m.length),
            half_length: measured.and_then(|m| m.half),
            elastic: record.measured(config, &[1]).map(|m| m.length),
            dice_end: path.map_or(0.0, |path| path.dice_end),
            gap_end: path.and_then(|path| path.gap_end),
            needless_contacts: path.map_or(0, |path| path.needless_contacts),
            arrival: path.and_then(|path| path.arrival),
            iterations: path.map_or(0, |path| path.iterations),
            evaluations: path.map_or(0, |path| path.evaluations),
            min_det: path.map_or(0.0, |path| path.min_det),
            status: path.map_or_else(String::new, |path| path.status.clone()),
            seconds: seconds(record),
        }
    }
}

fn marks<'a>(
    record: &'a PairRecord,
    config: &'a DistancesConfig,
) -> impl Iterator<Item = MarkRecord<'a>> {
    record.faulty().map(|path: &PathRecord| {
        let mut others = config
            .forms()
            .filter(|form| *form != path.form)
            .filter_map(|form| record.path(form, path.steps));
        let outcome = if path.usable(config).is_some() {
            MarkOutcome::Used
        } else if others.any(|other| other.usable(config).is_some()) {
            MarkOutcome::Replaced
        } else {
            MarkOutcome::LeftOut
        };
        MarkRecord {
            start: record.start,
            end: record.end,
            path,
            outcome,
        }
    })
}

impl<'a> ClusteringRecord<'a> {
    fn new(linkage: Linkage, distances: &'a Distances) -> Option<Self> {
        let completed = distances.completed.as_ref()?;
        Some(Self {
            linkage,
            merges: completed.tree.merges(),
            order: completed.tree.order(),
            clusters: completed.clusters,
            labels: &completed.labels,
        })
    }
}

impl<'a> EmbeddingRecord<'a> {
    fn new(map: &'a Map) -> Self {
        match map {
            Map::Whole {
                classical,
                refined,
                stress,
            } => Self::Whole(WholeRecord {
                points: &refined.points,
                stress: refined.stress,
                classical: ClassicalRecord {
                    points: &classical.points,
                    stress: *stress,
                    explained: classical.explained,
                    negative: classical.negative,
                    eigenvalues: &classical.eigenvalues,
                },
            }),
            Map::Landmarks(map) => Self::Landmarks(map),
        }
    }

    /// The stress, and the share of the variance that is explained.
    pub fn figures(&self) -> (f64, f64) {
        match self {
            Self::Whole(map) => (map.stress, map.classical.explained),
            Self::Landmarks(map) => map.figures(),
        }
    }
}
