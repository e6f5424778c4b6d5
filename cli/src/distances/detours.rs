//! Ways through third shapes that are shorter than paths, and the paths that are minimised from them.
//!
//! A distance is at most the sum of those from both shapes to any third one. Where a path is longer, or does not arrive, it is
//! not the shortest: it is minimised again from the shortest way through a third shape. Distances become shorter by that,
//! and other ways with them, so that this is repeated. What is computed depends on lengths only: a run that goes on
//! after an interruption finds the same.

use std::collections::{HashMap, HashSet};

use ::geodesic::distances::PathLengths;
use serde::Serialize;

use super::args::DistancesConfig;
use super::compute::Task;
use super::pair::{Detour, PairRecord, Way};
use super::study::Evaluated;
use crate::error::CliError;

/// A path that is minimised from a way is often much shorter than that, if the third shape is like neither end: of pairs of
/// letters with a way of less than this multiple of their path, five of six became shorter where both parts were longer than
/// a share of the path, and one of ten, by .3 %, where one of them was shorter.
const NEARLY: f64 = 1.15;
/// The share.
const LEAST_PART: f64 = 0.4;

/// Number of paths that were minimised from ways through third shapes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(super) struct Detours {
    /// Rounds in which there were such ways.
    pub rounds: usize,
    /// Pairs that were computed again, over all rounds.
    pub computed: usize,
    /// Of these, those whose paths were replaced.
    pub kept: usize,
}

impl Detours {
    /// Whether there were none.
    pub fn is_none(&self) -> bool {
        self.computed == 0
    }
}

/// Replaces the paths of pairs by those from ways through third shapes, where these arrive or are shorter; `None` if
/// interrupted.
///
/// # Errors
/// Those of [`Task::run`].
pub(super) fn shorten<const D: usize>(
    task: &Task<'_, D>,
    n: usize,
    mut records: Vec<PairRecord>,
) -> Result<Option<(Vec<PairRecord>, Detours)>, CliError> {
    let config = task.config;
    let mut found = Detours::default();
    let mut tried = HashSet::new();
    for round in 1..=config.detours() as usize {
        let lengths = Evaluated::new(n, &records, config).lengths;
        let ways = shorter_ways(&records, &lengths, config, &tried);
        if ways.is_empty() {
            break;
        }
        task.session.progress.note(format!(
            "detours, round {round}: {} pairs have a way through another shape that may be shorter",
            ways.len()
        ));
        let Some(other) = task.run_ways(&ways)? else {
            return Ok(None);
        };
        found.rounds = round;
        found.computed += ways.len();
        tried.extend(&ways);
        found.kept += replace(&mut records, &other, config);
    }
    Ok(Some((records, found)))
}

/// The pairs that have a shorter way through another shape than their path, or one through a shape between both that is nearly
/// as short, and those without a path that have a way at all; with the shape of the shortest one that has not been tried.
fn shorter_ways(
    records: &[PairRecord],
    lengths: &PathLengths,
    config: &DistancesConfig,
    tried: &HashSet<Way>,
) -> Vec<Way> {
    let directions = config.directions();
    let way = |record: &PairRecord| {
        let [i, j] = [record.start, record.end];
        let own = lengths.between(i, j).unwrap_or(f64::INFINITY);
        let others = (0..lengths.n_objects()).filter(|shape| ![i, j].contains(shape));
        let known = others.filter_map(|through| {
            let parts = [lengths.between(i, through)?, lengths.between(through, j)?];
            let length = parts[0] + parts[1];
            let is_between = parts[0].min(parts[1]) > LEAST_PART * own;
            let most = if is_between { NEARLY * own } else { own };
            let detour = Some(Detour {
                through,
                refinements: record.refinements,
            });
            let way = Way {
                ids: [i, j],
                detour,
            };
            (length < most && !tried.contains(&way)).then_some((length, way))
        });
        // The first of several of one length.
        let shortest = known.min_by(|a, b| a.0.total_cmp(&b.0));
        shortest.map(|(_, way)| way)
    };
    records
        .chunks(directions)
        .filter_map(|pair| way(&pair[0]))
        .collect()
}

/// Replaces the records of pairs by others of the same, where those are better; returns the number of pairs.
fn replace(records: &mut [PairRecord], others: &[PairRecord], config: &DistancesConfig) -> usize {
    let directions = config.directions();
    let of_pair: HashMap<[usize; 2], usize> = (0..records.len())
        .step_by(directions)
        .map(|at| ([records[at].start, records[at].end], at))
        .collect();
    let mut kept = 0;
    for other in others.chunks(directions) {
        let Some(&at) = of_pair.get(&[other[0].start, other[0].end]) else {
            continue;
        };
        let own = &mut records[at..at + directions];
        if rank(other, config) > rank(own, config) {
            kept += 1;
            for (own, other) in own.iter_mut().zip(other) {
                own.replace_by(other, config.params.form);
            }
        }
    }
    kept
}

/// What paths of a pair are chosen by: how many arrive, how many have a length, and their lengths.
fn rank(pair: &[PairRecord], config: &DistancesConfig) -> (usize, usize, f64) {
    let arrive = pair.iter().filter(|record| record.arrives(config));
    let lengths = pair
        .iter()
        .filter_map(|record| record.measured(config, &config.steps()));
    let lengths: Vec<f64> = lengths.map(|measured| measured.length).collect();
    (arrive.count(), lengths.len(), -lengths.iter().sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distances::pair::{Place, tests::path};
    use ::geodesic::{Form, GeodesicParams};

    const FORM: Form = Form::Lagrangian;

    fn config() -> DistancesConfig {
        DistancesConfig {
            params: GeodesicParams {
                steps: 4,
                ..GeodesicParams::default()
            },
            ..DistancesConfig::default()
        }
    }

    /// Both directions of a pair; a length of zero is that of a path that does not arrive.
    fn pair(ids: [usize; 2], through: Option<usize>, lengths: [f64; 2]) -> Vec<PairRecord> {
        let place = Place {
            ids,
            magnification: 1.0,
            refinements: 1,
            through,
        };
        let mut records = place.records(2);
        for (record, length) in records.iter_mut().zip(lengths) {
            for (steps, length) in [(4, length), (1, 9.0)] {
                let mut path = path(FORM, steps, length > 0.0);
                path.length = Some(length);
                record.paths.push(path);
            }
        }
        records
    }

    fn all() -> Vec<PairRecord> {
        [
            pair([0, 1], None, [1.0, 1.0]),
            pair([0, 2], None, [3.1, 3.3]),
            pair([0, 3], None, [0.0, 0.0]),
            pair([1, 2], None, [2.0, 2.0]),
            pair([1, 3], None, [3.9, 3.9]),
            pair([2, 3], None, [2.5, 2.5]),
        ]
        .concat()
    }

    fn ways(records: &[PairRecord], tried: &[Way]) -> Vec<([usize; 2], usize)> {
        let lengths = Evaluated::new(4, records, &config()).lengths;
        let tried = tried.iter().copied().collect();
        let found = shorter_ways(records, &lengths, &config(), &tried).into_iter();
        found
            .map(|way| {
                let detour = way.detour.unwrap();
                assert_eq!(detour.refinements, 1);
                (way.ids, detour.through)
            })
            .collect()
    }

    #[test]
    fn violated_triangles_and_missing_paths_have_ways() {
        let records = all();
        // 3.2 is more than 1 + 2; without a path, 1 + 3.9 is less than 3.2 + 2.5.
        assert_eq!(ways(&records, &[]), [([0, 2], 1), ([0, 3], 1)]);
        let tried = [1, 2].map(|through| Way {
            ids: [0, 3],
            detour: Some(Detour {
                through,
                refinements: 1,
            }),
        });
        assert_eq!(ways(&records, &tried[..1]), [([0, 2], 1), ([0, 3], 2)]);
        assert_eq!(ways(&records, &tried), [([0, 2], 1)]);
        // 2 + 2.5 is more than 1.15 times 3.9, but not than that of 4.2, and both parts are nearly half of it.
        let longer = [
            &records[..8],
            &pair([1, 3], None, [4.2, 4.2]),
            &records[10..],
        ]
        .concat();
        assert_eq!(ways(&longer, &tried), [([0, 2], 1), ([1, 3], 2)]);
    }

    #[test]
    fn what_arrives_or_is_shorter_is_kept() {
        let mut records = all();
        let longer = pair([0, 2], Some(1), [3.0, 3.5]);
        let one_arrives = pair([0, 3], Some(1), [5.2, 0.0]);
        let found = replace(&mut records, &[longer, one_arrives].concat(), &config());
        assert_eq!(found, 1);
        let through: Vec<_> = records.iter().map(|record| record.through).collect();
        let mut expected = [None; 12];
        expected[4..6].fill(Some(1));
        assert_eq!(through, expected);
        let shorter = pair([0, 2], Some(1), [2.9, 3.3]);
        assert_eq!(replace(&mut records, &shorter, &config()), 1);
        let length = |at: usize| records[at].path(FORM, 4).unwrap().length;
        assert_eq!((length(2), length(3)), (Some(2.9), Some(3.3)));
        // The path of one step is left.
        assert!(records.iter().all(|record| record.paths.len() == 2));
        // Where the way does not arrive, there is nothing.
        let mut nothing = pair([0, 1], Some(2), [0.5, 0.5]);
        for record in &mut nothing {
            record.paths.clear();
        }
        assert_eq!(replace(&mut records, &nothing, &config()), 0);
        assert_eq!(records[0].through, None);
    }
}
