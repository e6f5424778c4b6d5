//! Relabellings of shapes, random or all of them, and the p-values that they give.

use fe_grid::parallel::map;
use fe_grid::random::SplitMix64;

/// How many relabellings a test tries: all different ones where there are no more, else random ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Relabelling {
    /// Number of random permutations, and the largest number of different ones that are all tried.
    pub permutations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Default for Relabelling {
    fn default() -> Self {
        Self {
            permutations: 9999,
            seed: 0,
        }
    }
}

/// The odd constant of SplitMix64, which separates the seeds of successive relabellings.
const STRIDE: u64 = 0x9e37_79b9_7f4a_7c15;
/// Relative difference up to which statistics count as equal: sums in another order differ by rounding.
const EQUAL: f64 = 1e-10;

/// Relabellings that one thread tries at a time.
const BLOCK: usize = 64;

/// The p-values of several statistics.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PValues {
    /// Of every statistic by itself.
    pub single: Vec<f64>,
    /// Of every statistic by the largest of all: the probability that any is as large.
    pub largest: Vec<f64>,
}

impl Relabelling {
    /// The permutation with this number.
    pub(super) fn permuted<T: Copy>(&self, number: usize, given: &[T]) -> Vec<T> {
        let start = self.seed ^ STRIDE.wrapping_mul(number as u64 + 1).rotate_left(17);
        let mut random = SplitMix64::new(start);
        let mut all = given.to_vec();
        // Fisher and Yates.
        for last in (1..all.len()).rev() {
            let other = (random.uniform() * (last + 1) as f64) as usize;
            all.swap(last, other.min(last));
        }
        all
    }

    /// Computes the p-values of the statistics of given labels, large where labels matter.
    ///
    /// `p = (1 + #{permutations with a statistic at least as large}) / (1 + #permutations)` of random ones; where all
    /// different ones are tried, their share, the given one included.
    ///
    /// Source: Phipson and Smyth, *Permutation P-values Should Never Be Zero* (2010); for the largest of
    /// all statistics Westfall and Young, *Resampling-Based Multiple Testing* (1993).
    pub(super) fn p_values<T: Copy + PartialEq + Sync>(
        &self,
        given: &[T],
        statistics: &(dyn Fn(&[T]) -> Vec<f64> + Sync),
    ) -> PValues {
        let own = statistics(given);
        let all = arrangements(given, self.permutations);
        let (n_tried, n_given) = match &all {
            // The given one is among them.
            Some(all) => (all.len(), 0),
            None => (self.permutations, 1),
        };
        let labels = |number: usize| match &all {
            Some(all) => all[number].iter().map(|place| given[*place]).collect(),
            None => self.permuted(number, given),
        };
        let starts: Vec<usize> = (0..n_tried).step_by(BLOCK).collect();
        let found = map(starts, &|start| {
            let mut counted = vec![[0u32; 2]; own.len()];
            for number in start..n_tried.min(start + BLOCK) {
                let of_labels = statistics(&labels(number));
                let largest = of_labels.iter().copied().fold(f64::MIN, f64::max);
                for ((count, &x), &y) in counted.iter_mut().zip(&own).zip(&of_labels) {
                    let least = x - EQUAL * x.abs();
                    count[0] += u32::from(y >= least);
                    count[1] += u32::from(largest >= least);
                }
            }
            counted
        });
        // The given labels are one of the relabellings.
        let mut counted = vec![[n_given; 2]; own.len()];
        for block in &found {
            for (count, more) in counted.iter_mut().zip(block) {
                count[0] += more[0];
                count[1] += more[1];
            }
        }
        let all = n_tried as f64 + f64::from(n_given);
        let share = |k: usize| counted.iter().map(|c| f64::from(c[k]) / all).collect();
        PValues {
            single: share(0),
            largest: share(1),
        }
    }
}

/// All different arrangements of some labels, as places of labels, if there are at most `most`.
fn arrangements<T: PartialEq>(given: &[T], most: usize) -> Option<Vec<Vec<usize>>> {
    // The place of the first label that is equal.
    let first = |label: &T| given.iter().position(|other| other == label).unwrap_or(0);
    let mut places: Vec<usize> = given.iter().map(first).collect();
    places.sort_unstable();
    let sizes: Vec<usize> = places.chunk_by(|a, b| a == b).map(<[usize]>::len).collect();
    if n_relabellings(&sizes) > most as f64 + 0.5 {
        return None;
    }
    let mut all = vec![places.clone()];
    // The next one in lexicographic order: the last ascent is raised, and what follows turned around.
    while let Some(ascent) = places.windows(2).rposition(|pair| pair[0] < pair[1]) {
        let larger = places.iter().rposition(|place| *place > places[ascent]);
        places.swap(ascent, larger.unwrap_or(ascent + 1));
        places[ascent + 1..].reverse();
        all.push(places.clone());
    }
    Some(all)
}

/// The number of different relabellings of groups of these sizes, `n! / (n_1! ... n_g!)`.
pub(super) fn n_relabellings(sizes: &[usize]) -> f64 {
    let (mut count, mut n) = (1.0, 0.0);
    for &size in sizes {
        for k in 1..=size {
            n += 1.0;
            count *= n / k as f64;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn every_order_is_equally_likely() {
        let relabelling = Relabelling::default();
        let mut counts = BTreeMap::new();
        for number in 0..6000 {
            *counts
                .entry(relabelling.permuted(number, &[0, 1, 2]))
                .or_insert(0) += 1;
        }
        assert_eq!(counts.len(), 6);
        // Four standard deviations of a binomial distribution, sqrt(6000 5/36) = 28.9.
        assert!(
            counts.values().all(|n| (*n - 1000_i32).abs() < 116),
            "{counts:?}"
        );
    }

    #[test]
    fn all_arrangements_are_tried_where_they_are_few() {
        let all = arrangements(&[5, 5, 7, 5, 9], 20).unwrap();
        // 5! / 3!, all different, each with three of the first label.
        assert_eq!(all.len(), 20);
        assert!(all.windows(2).all(|pair| pair[0] < pair[1]));
        let threes = |places: &Vec<usize>| places.iter().filter(|place| **place == 0).count() == 3;
        assert!(all.iter().all(threes));
        assert!(arrangements(&[5, 5, 7, 5, 9], 19).is_none());
        // The difference of the means of three and three numbers: of 20 arrangements two are as far apart.
        let values = [1.0, 1.5, 1.7, 4.0, 4.1, 5.0];
        let apart = |labels: &[usize]| {
            let sums = labels
                .iter()
                .zip(values)
                .fold([0.0; 2], |mut sums, (label, value)| {
                    sums[*label] += value;
                    sums
                });
            vec![f64::abs(sums[0] - sums[1])]
        };
        let found = Relabelling::default().p_values(&[0, 0, 0, 1, 1, 1], &apart);
        assert_eq!(found.single, [0.1]);
        assert_eq!(found.largest, [0.1]);
    }

    #[test]
    fn relabellings_are_counted() {
        assert_eq!(n_relabellings(&[3, 2]), 10.0);
        assert_eq!(n_relabellings(&[2, 2, 2]), 90.0);
    }
}
