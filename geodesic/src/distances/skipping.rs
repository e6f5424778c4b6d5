//! Nearest neighbours without all distances: which lengths have to be computed.
//!
//! A *surrogate* is a number for every pair that costs little and grows with the length of its path, in
//! the same unit. On a sample of pairs whose lengths are known, [`LowerBound::calibrate`] determines a
//! factor that lengths are, but for a given share of them, at least the factor times the surrogate.
//! Pairs whose bound is longer than the neighbours that are known already need no path
//! ([`Search::next`]). The bound is calibrated, not proven: a neighbour that is unlike the sample may be
//! missed. [`kept`] measures how many are, where all lengths from an object are known.

/// Lower bound of lengths: a factor times the surrogate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowerBound {
    /// The factor; zero if the sample is too small.
    pub factor: f64,
    /// Number of pairs in the sample.
    pub sample: usize,
}

impl LowerBound {
    /// Computes the factor from pairs of a surrogate and a length: of `m` quotients of length and
    /// surrogate the one of rank `floor(share (m + 1))` from below. A further pair of the same
    /// distribution is then shorter than its bound with a probability of at most `share` (split conformal
    /// prediction: Papadopoulos, Proedrou, Vovk and Gammerman 2002). Surrogates of zero are left out.
    pub fn calibrate(pairs: impl IntoIterator<Item = (f64, f64)>, share: f64) -> Self {
        let known = pairs.into_iter().filter(|(surrogate, _)| *surrogate > 0.0);
        let mut quotients: Vec<f64> = known
            .map(|(surrogate, length)| length / surrogate)
            .collect();
        quotients.sort_by(f64::total_cmp);
        let sample = quotients.len();
        let rank = (share * (sample + 1) as f64).floor() as usize;
        let factor = match rank {
            0 => 0.0,
            rank => quotients[rank.min(sample) - 1],
        };
        Self {
            factor: if factor.is_finite() { factor } else { 0.0 },
            sample,
        }
    }

    /// The bound of a length by its surrogate.
    pub fn of(&self, surrogate: f64) -> f64 {
        self.factor * surrogate
    }
}

/// What is known of the length between two objects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known {
    /// It was not computed.
    Nothing,
    /// There is no path of any use.
    NoPath,
    /// The length.
    Length(f64),
}

/// Search for the nearest neighbours of some objects.
#[derive(Clone, Debug)]
pub struct Search {
    /// Number of neighbours.
    count: usize,
    bound: LowerBound,
    /// For every object its number, and its candidates with their surrogates, the smallest first.
    objects: Vec<(usize, Vec<(usize, f64)>)>,
}

impl Search {
    /// Creates the search of the `count` nearest candidates of every object, which are given with their
    /// surrogates. Candidates without a surrogate count as near.
    pub fn new(
        count: usize,
        bound: LowerBound,
        objects: impl IntoIterator<Item = (usize, Vec<(usize, Option<f64>)>)>,
    ) -> Self {
        let sorted = |candidates: Vec<(usize, Option<f64>)>| {
            let known = candidates.into_iter();
            let mut known: Vec<(usize, f64)> =
                known.map(|(other, s)| (other, s.unwrap_or(0.0))).collect();
            known.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
            known
        };
        let objects = objects.into_iter();
        Self {
            count,
            bound,
            objects: objects
                .map(|(o, candidates)| (o, sorted(candidates)))
                .collect(),
        }
    }

    /// Returns the pairs whose lengths are to be computed next, sorted and the smaller number first: of
    /// every object the `most` candidates of smallest surrogate that may be nearer than the `count`-th
    /// nearest that is known. None if all neighbours are found.
    pub fn next(&self, most: usize, known: impl Fn(usize, usize) -> Known) -> Vec<[usize; 2]> {
        let mut pairs: Vec<[usize; 2]> = Vec::new();
        for (object, candidates) in &self.objects {
            let lengths = candidates
                .iter()
                .filter_map(|&(other, _)| match known(*object, other) {
                    Known::Length(length) => Some(length),
                    _ => None,
                });
            let radius = smallest(lengths, self.count);
            let near = candidates
                .iter()
                .take_while(|(_, surrogate)| self.bound.of(*surrogate) <= radius)
                .filter(|&&(other, _)| known(*object, other) == Known::Nothing);
            let pair = |&(other, _): &(usize, f64)| [*object.min(&other), *object.max(&other)];
            pairs.extend(near.take(most).map(pair));
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }
}

/// The `count`-th smallest number; infinite if there are fewer.
fn smallest(numbers: impl Iterator<Item = f64>, count: usize) -> f64 {
    let mut all: Vec<f64> = numbers.collect();
    all.sort_by(f64::total_cmp);
    all.get(count.saturating_sub(1))
        .copied()
        .unwrap_or(f64::INFINITY)
}

/// Counts how many of the `count` nearest neighbours of one object a search with this bound finds, and
/// how many there are, from the surrogates and lengths of all its candidates: they are gone through by
/// their surrogates, until the bound exceeds the `count`-th nearest found so far.
pub fn kept(candidates: &[(f64, f64)], count: usize, bound: LowerBound) -> [usize; 2] {
    let mut sorted = candidates.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found: Vec<f64> = Vec::new();
    for &(surrogate, length) in &sorted {
        if bound.of(surrogate) > smallest(found.iter().copied(), count) {
            break;
        }
        found.push(length);
    }
    let radius = smallest(candidates.iter().map(|(_, length)| *length), count);
    let near = |length: &&f64| **length <= radius;
    let all = candidates
        .iter()
        .filter(|(_, length)| *length <= radius)
        .count();
    [found.iter().filter(near).count(), all]
}
