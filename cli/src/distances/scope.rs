//! Which pairs of shapes have a distance: all of them, or those of new and stored shapes.

use std::ops::Range;

use super::args::DistancesConfig;

/// The pairs whose distances are asked for. Shapes are numbered as they are read: the inputs first,
/// then those of `--against`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Scope {
    /// Number of inputs.
    inputs: usize,
    /// Number of stored shapes that they are compared with; none where all pairs are asked for.
    stored: Option<usize>,
}

impl Scope {
    pub fn new(config: &DistancesConfig) -> Self {
        let stored = config.against.len();
        Self {
            inputs: config.inputs.len(),
            stored: (stored > 0).then_some(stored),
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

    /// The pairs, the smaller number first, in the order of these numbers.
    pub fn pairs(&self) -> Vec<[usize; 2]> {
        let columns = self.columns();
        let from = move |i: usize| columns.start.max(i + 1)..columns.end;
        let pairs = self.rows().flat_map(|i| from(i).map(move |j| [i, j]));
        pairs.collect()
    }
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

    fn scope(inputs: usize, against: usize) -> Scope {
        let named = |n: usize| (0..n).map(|i| format!("{i}.png").into()).collect();
        Scope::new(&DistancesConfig {
            inputs: named(inputs),
            against: named(against),
            ..DistancesConfig::default()
        })
    }

    #[test]
    fn every_pair_is_asked_for_once() {
        assert_eq!(scope(3, 0).pairs(), [[0, 1], [0, 2], [1, 2]]);
        assert_eq!(scope(2, 2).pairs(), [[0, 2], [0, 3], [1, 2], [1, 3]]);
        assert_eq!(scope(1, 1).pairs(), [[0, 1]]);
        assert_eq!((scope(2, 3).columns(), scope(2, 3).n_shapes()), (2..5, 5));
        assert_eq!(
            (scope(2, 0).columns(), scope(2, 0).is_across()),
            (0..2, false)
        );
        assert_eq!(paths(&[[0, 2]], false), [[0, 2], [2, 0]]);
        assert_eq!(paths(&[[0, 2]], true), [[0, 2]]);
    }
}
