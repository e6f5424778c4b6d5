//! Nearest neighbours without the paths of far pairs.
//!
//! All paths of a random sample of shapes are computed first. They calibrate the lower bound of the
//! lengths by their surrogates, and measure how many neighbours it would lose. Then the paths of pairs
//! that may be near are computed in rounds: those of every shape with the smallest surrogates, until the
//! bounds of all others exceed the distance of its last neighbour. What is computed depends on lengths
//! only, so that a run that goes on after an interruption finds the same.

use std::collections::HashSet;

use ::geodesic::distances::{Known, LowerBound, PathLengths, Search, kept};
use serde::Serialize;

use super::compute::Task;
use super::pair::PairRecord;
use super::scope::{Scope, paths};
use super::study::Evaluated;
use super::surrogate::{Surrogates, surrogates};
use crate::error::CliError;

/// Paths of each shape in a round after the first.
const ROUND: usize = 2;

/// What was skipped, and how many neighbours may be missed.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Skipped {
    /// Pairs of the matrix, and those of them that were computed.
    pub pairs: usize,
    pub computed: usize,
    /// Lengths are at least this factor times the surrogate, but for a share of `--skip-far`.
    pub factor: f64,
    /// Number of lengths by which it was determined.
    pub calibrated_on: usize,
    /// The shapes of which all paths were computed.
    pub sample: Vec<usize>,
    /// The `--neighbours` nearest of these that are found by the bound that the others give, and how many
    /// there are. Shapes for which the others are too few for a bound do not count.
    pub kept: [usize; 2],
    /// The same of their nearest only.
    pub nearest_kept: [usize; 2],
    /// Rounds of paths after those of the sample.
    pub rounds: usize,
}

/// Computes the paths of pairs that may be near, in addition to `records`; `None` if interrupted.
///
/// # Errors
/// Those of [`Task::run`].
pub(super) fn near_pairs<const D: usize>(
    task: &Task<'_, D>,
    scope: &Scope,
    share: f64,
    mut records: Vec<PairRecord>,
) -> Result<Option<(Vec<PairRecord>, Skipped)>, CliError> {
    let count = task.config.listed_neighbours().unwrap_or(1);
    let matrix = scope.matrix();
    let Some(found) = surrogates(task, &matrix)? else {
        return Ok(None);
    };
    let sample = scope.sample().unwrap_or_default();
    let between =
        |records: &[PairRecord]| Evaluated::new(scope.n_shapes(), records, task.config).between;
    let estimates = Estimates {
        scope,
        surrogates: &found,
    };
    let known = between(&records);
    let bound = estimates.bound(sample, None, &known, share);
    let mut skipped = Skipped {
        pairs: matrix.len(),
        computed: 0,
        factor: bound.factor,
        calibrated_on: bound.sample,
        sample: sample.to_vec(),
        kept: estimates.kept(sample, &known, count, share),
        nearest_kept: estimates.kept(sample, &known, 1, share),
        rounds: 0,
    };
    let rows = scope.rows().map(|row| (row, estimates.candidates(row)));
    let search = Search::new(count, bound, rows);
    let mut computed: HashSet<[usize; 2]> = records.iter().map(PairRecord::pair).collect();
    let mut most = count;
    loop {
        let known = between(&records);
        let next = search.next(most, |i, j| match known.between(i, j) {
            Some(length) => Known::Length(length),
            None if computed.contains(&[i.min(j), i.max(j)]) => Known::NoPath,
            None => Known::Nothing,
        });
        if next.is_empty() {
            break;
        }
        let near = next.len();
        let round = format!(
            "round {}: {near} more pairs may be near",
            skipped.rounds + 1
        );
        task.session.progress.note(round);
        let wanted = paths(&next, task.config.one_way);
        let Some(more) = task.run(&wanted)? else {
            return Ok(None);
        };
        records.extend(more);
        computed.extend(next);
        skipped.rounds += 1;
        most = ROUND;
    }
    skipped.computed = matrix
        .iter()
        .filter(|pair| computed.contains(*pair))
        .count();
    records.sort_by_key(|record| (record.pair(), record.start));
    Ok(Some((records, skipped)))
}

/// The surrogates of the pairs of a matrix.
struct Estimates<'a> {
    scope: &'a Scope,
    surrogates: &'a Surrogates,
}

impl Estimates<'_> {
    /// The other shapes of a row with their surrogates.
    fn candidates(&self, row: usize) -> Vec<(usize, Option<f64>)> {
        let others = self.scope.columns().filter(|&other| other != row);
        let value = |other: usize| {
            let pair = [row.min(other), row.max(other)];
            self.surrogates.get(&pair).copied()
        };
        others.map(|other| (other, value(other))).collect()
    }

    /// The other shapes of a row, with surrogate and length, as far as both are known.
    fn known<'a>(
        &'a self,
        row: usize,
        lengths: &'a PathLengths,
    ) -> impl Iterator<Item = (usize, (f64, f64))> + 'a {
        let candidates = self.candidates(row).into_iter();
        candidates.filter_map(move |(other, surrogate)| {
            Some((other, (surrogate?, lengths.between(row, other)?)))
        })
    }

    /// The bound by the pairs of these rows, but for those with one shape.
    fn bound(
        &self,
        rows: &[usize],
        except: Option<usize>,
        lengths: &PathLengths,
        share: f64,
    ) -> LowerBound {
        let others = rows.iter().filter(|&&row| Some(row) != except);
        // A pair of two of the rows counts once.
        let is_first = |row: usize, other: usize| row < other || !rows.contains(&other);
        let pairs = others.flat_map(|&row| {
            let pairs = self.known(row, lengths);
            pairs.filter(move |(other, _)| Some(*other) != except && is_first(row, *other))
        });
        LowerBound::calibrate(pairs.map(|(_, pair)| pair), share)
    }

    /// The nearest neighbours in these rows that are found by the bound of the other rows, and all.
    fn kept(&self, rows: &[usize], lengths: &PathLengths, count: usize, share: f64) -> [usize; 2] {
        let factor = self.bound(rows, None, lengths, share).factor;
        let mut sum = [0; 2];
        for &row in rows {
            let bound = self.bound(rows, Some(row), lengths, share);
            // A bound by which nothing is skipped tells nothing of another by which much is.
            if bound.factor == 0.0 && factor > 0.0 {
                continue;
            }
            let candidates = self.known(row, lengths).map(|(_, pair)| pair);
            let candidates: Vec<(f64, f64)> = candidates.collect();
            let found = kept(&candidates, count, bound);
            sum = [sum[0] + found[0], sum[1] + found[1]];
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distances::DistancesConfig;

    /// Shapes on a line, whose surrogates are their distances but for a pair that seems far apart.
    const PLACES: [f64; 8] = [0.0, 2.0, 3.5, 1.0, 4.7, 6.1, 7.9, 9.0];
    const ODD: [usize; 2] = [0, 3];

    fn apart(i: usize, j: usize) -> f64 {
        (PLACES[i] - PLACES[j]).abs()
    }

    #[test]
    fn each_shape_is_measured_by_the_bound_of_the_others() {
        let scope = Scope::new(&DistancesConfig {
            inputs: (0..8).map(|i| format!("{i}.png").into()).collect(),
            ..DistancesConfig::default()
        });
        let value = |[i, j]: [usize; 2]| apart(i, j) * if [i, j] == ODD { 5.0 } else { 1.0 };
        let matrix = scope.matrix().into_iter();
        let estimates = Estimates {
            scope: &scope,
            surrogates: &matrix.map(|pair| (pair, value(pair))).collect(),
        };
        let lengths = PathLengths::from_fn(8, |i, j| Some(apart(i, j)));
        let rows = [0, 1, 2];
        // A pair of two rows counts once, those of the shape that is left out do not.
        let all = estimates.bound(&rows, None, &lengths, 0.1);
        assert_eq!((all.sample, all.factor), (18, 0.2));
        let others = estimates.bound(&rows, Some(0), &lengths, 0.1);
        assert_eq!((others.sample, others.factor), (11, 1.0));
        // The first loses its nearest neighbour by the bound of the others, which know no such pair.
        assert_eq!(estimates.kept(&rows, &lengths, 1, 0.1), [2, 3]);
        assert_eq!(estimates.kept(&rows, &lengths, 2, 0.1), [5, 6]);
        // Of eleven pairs no sixteenth is left out, of eighteen it is.
        assert_eq!(estimates.kept(&rows, &lengths, 1, 0.06), [0, 0]);
    }
}
