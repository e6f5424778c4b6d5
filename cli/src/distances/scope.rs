//! Which pairs of shapes have a distance: all of them, those of new and stored shapes, those of
//! landmarks, or those that may be near.

use std::ops::Range;

use ::geodesic::distances::random_sample;

use super::args::DistancesConfig;

/// The same landmarks in every run.
const SEED: u64 = 0;
/// Fewest landmarks of a map, which also measure how many neighbours are kept.
const LEAST_LANDMARKS: usize = 4;
/// Fewest new shapes that do: each is measured by the bound of the others.
const LEAST_SAMPLE: usize = 2;

/// The pairs whose distances are asked for. Shapes are numbered as they are read: the inputs first,
/// then those of `--against`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Scope {
    /// Number of inputs.
    inputs: usize,
    /// Number of stored shapes that they are compared with; none where all pairs are asked for.
    stored: Option<usize>,
    /// Shapes with paths to all others, sorted; stored ones if there are any. None unless there are to be
    /// some.
    landmarks: Vec<usize>,
    /// Shapes of the rows of which all paths are computed, if far pairs are skipped.
    sample: Option<Vec<usize>>,
}

impl Scope {
    pub fn new(config: &DistancesConfig) -> Self {
        let (inputs, stored) = (config.inputs.len(), config.against.len());
        let skips = config.skip_far.is_some();
        let columns = if stored > 0 { stored } else { inputs };
        let count = match config.landmarks {
            None if skips && stored == 0 => sample_size(inputs).max(LEAST_LANDMARKS),
            given => given.unwrap_or(0),
        };
        let first = if stored > 0 { inputs } else { 0 };
        let landmarks = random_sample(columns, count, SEED).into_iter();
        let landmarks: Vec<usize> = landmarks.map(|k| first + k).collect();
        let sample = if stored > 0 {
            random_sample(inputs, sample_size(inputs).max(LEAST_SAMPLE), SEED)
        } else {
            landmarks.clone()
        };
        Self {
            inputs,
            stored: (stored > 0).then_some(stored),
            landmarks,
            sample: skips.then_some(sample),
        }
    }

    /// The number of shapes.
    pub fn n_shapes(&self) -> usize {
        self.inputs + self.stored.unwrap_or(0)
    }

    /// Whether new shapes are compared with stored ones.
    pub fn is_across(&self) -> bool {
        self.stored.is_some()
    }

    /// Whether the distances between all shapes are asked for.
    pub fn is_all(&self) -> bool {
        !self.is_across() && !self.is_sparse()
    }

    /// Whether distances of the matrix are left out.
    pub fn is_sparse(&self) -> bool {
        self.sample.is_some() || (!self.is_across() && !self.landmarks.is_empty())
    }

    /// The shapes with paths to all others.
    pub fn landmarks(&self) -> &[usize] {
        &self.landmarks
    }

    /// The shapes of rows without gaps, if far pairs are skipped.
    pub fn sample(&self) -> Option<&[usize]> {
        self.sample.as_deref()
    }

    /// The shapes whose distances are asked for.
    pub fn rows(&self) -> Range<usize> {
        0..self.inputs
    }

    /// The shapes to which they are asked for.
    pub fn columns(&self) -> Range<usize> {
        match self.stored {
            Some(stored) => self.inputs..self.inputs + stored,
            None => 0..self.inputs,
        }
    }

    /// The pairs of the matrix, the smaller number first, in the order of these numbers.
    pub fn matrix(&self) -> Vec<[usize; 2]> {
        let columns = self.columns();
        let from = move |i: usize| columns.start.max(i + 1)..columns.end;
        let pairs = self.rows().flat_map(|i| from(i).map(move |j| [i, j]));
        pairs.collect()
    }

    /// The pairs that may be computed.
    pub fn possible(&self) -> Vec<[usize; 2]> {
        let skips = self.sample.is_some();
        let all = self.is_across() || self.landmarks.is_empty() || skips;
        self.with_landmarks(|_| all)
    }

    /// The pairs that are computed, whatever comes out for the others.
    pub fn asked_for(&self) -> Vec<[usize; 2]> {
        match &self.sample {
            Some(sample) => self.with_landmarks(|pair| is_in(sample, pair)),
            None => self.possible(),
        }
    }

    /// Those pairs of the matrix, and all pairs of a landmark with another shape of the columns.
    fn with_landmarks(&self, take: impl Fn([usize; 2]) -> bool) -> Vec<[usize; 2]> {
        let matrix = self.matrix().into_iter();
        let of_matrix = matrix.filter(|&pair| take(pair) || is_in(&self.landmarks, pair));
        let among_columns = self.landmarks.iter().flat_map(|&landmark| {
            let others = self.columns().filter(move |&other| other != landmark);
            others.map(move |other| [landmark.min(other), landmark.max(other)])
        });
        let mut pairs: Vec<[usize; 2]> = of_matrix.chain(among_columns).collect();
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }
}

fn is_in(shapes: &[usize], pair: [usize; 2]) -> bool {
    pair.iter().any(|shape| shapes.binary_search(shape).is_ok())
}

/// Number of shapes whose neighbours are all computed: few beside all, and many enough to measure by.
fn sample_size(n: usize) -> usize {
    ((n as f64).sqrt() / 2.0).ceil() as usize
}

/// The paths of pairs, in one direction or in both.
pub(super) fn paths(pairs: &[[usize; 2]], one_way: bool) -> Vec<[usize; 2]> {
    if one_way {
        return pairs.to_vec();
    }
    pairs.iter().flat_map(|&[i, j]| [[i, j], [j, i]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(inputs: usize, against: usize) -> DistancesConfig {
        let named = |n: usize| (0..n).map(|i| format!("{i}.png").into()).collect();
        DistancesConfig {
            inputs: named(inputs),
            against: named(against),
            ..DistancesConfig::default()
        }
    }

    fn scope(inputs: usize, against: usize) -> Scope {
        Scope::new(&config(inputs, against))
    }

    #[test]
    fn every_pair_is_asked_for_once() {
        assert_eq!(scope(3, 0).asked_for(), [[0, 1], [0, 2], [1, 2]]);
        let across = scope(2, 2);
        assert_eq!(across.asked_for(), [[0, 2], [0, 3], [1, 2], [1, 3]]);
        assert_eq!(across.asked_for(), across.possible());
        assert_eq!(scope(1, 1).asked_for(), [[0, 1]]);
        assert_eq!((scope(2, 3).columns(), scope(2, 3).n_shapes()), (2..5, 5));
        assert_eq!(scope(2, 0).columns(), 0..2);
        assert!(scope(2, 0).is_all() && !across.is_all() && !across.is_sparse());
        assert_eq!(paths(&[[0, 2]], false), [[0, 2], [2, 0]]);
        assert_eq!(paths(&[[0, 2]], true), [[0, 2]]);
    }

    #[test]
    fn landmarks_have_all_paths() {
        let square = Scope::new(&DistancesConfig {
            landmarks: Some(3),
            ..config(10, 0)
        });
        assert_eq!(square.landmarks().len(), 3);
        assert_eq!(square.asked_for().len(), 3 * 7 + 3);
        assert_eq!(square.asked_for(), square.possible());
        assert!(square.is_sparse());
        let across = Scope::new(&DistancesConfig {
            landmarks: Some(2),
            ..config(3, 6)
        });
        assert!(across.landmarks().iter().all(|&l| l >= 3) && !across.is_sparse());
        // New and stored ones, and the landmarks with the other stored ones.
        assert_eq!(across.asked_for().len(), 3 * 6 + 2 * 4 + 1);
    }

    #[test]
    fn only_the_sample_is_certain_where_far_pairs_are_skipped() {
        let skipping = |inputs, against| {
            Scope::new(&DistancesConfig {
                skip_far: Some(0.05),
                ..config(inputs, against)
            })
        };
        let square = skipping(36, 0);
        assert_eq!(
            (square.sample(), square.landmarks().len()),
            (Some(square.landmarks()), 4)
        );
        assert_eq!(square.asked_for().len(), 4 * 32 + 6);
        assert_eq!(square.possible().len(), 36 * 35 / 2);
        let across = skipping(9, 20);
        assert_eq!(
            (across.sample().unwrap().len(), across.landmarks()),
            (2, &[][..])
        );
        assert_eq!(
            (across.asked_for().len(), across.possible().len()),
            (2 * 20, 9 * 20)
        );
    }
}
