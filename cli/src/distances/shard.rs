//! Parts of the pairs, for several machines.

use std::fmt;
use std::str::FromStr;

/// One of several parts of the pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Its number, from 1.
    number: usize,
    /// Number of parts.
    of: usize,
}

/// A text that names no part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a part is its number, from 1, and the number of parts, such as 3/8")]
pub struct NoShard;

impl FromStr for Shard {
    type Err = NoShard;

    fn from_str(text: &str) -> Result<Self, NoShard> {
        let (number, of) = text.split_once('/').ok_or(NoShard)?;
        let [number, of]: [usize; 2] = [
            number.trim().parse().map_err(|_| NoShard)?,
            of.trim().parse().map_err(|_| NoShard)?,
        ];
        if number == 0 || number > of {
            return Err(NoShard);
        }
        Ok(Self { number, of })
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}/{}", self.number, self.of)
    }
}

impl Shard {
    /// The pairs of this part: every `of`-th one, so that all parts have pairs of all shapes and about
    /// the same work. A pair is a number of consecutive directions.
    pub(super) fn part(self, wanted: &[[usize; 2]], directions: usize) -> Vec<[usize; 2]> {
        let pairs = wanted.chunks(directions).skip(self.number - 1);
        pairs.step_by(self.of).flatten().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_numbered_from_one() {
        assert_eq!("3/8".parse(), Ok(Shard { number: 3, of: 8 }));
        assert_eq!("1/1".parse::<Shard>().unwrap().to_string(), "1/1");
        for wrong in [
            "", "3", "0/2", "3/2", "1/0", "-1/2", "a/b", "1/2/3", "1.5/2",
        ] {
            assert_eq!(wrong.parse::<Shard>(), Err(NoShard), "{wrong}");
        }
    }

    #[test]
    fn every_pair_is_in_one_part() {
        let pairs: Vec<_> = (0..7)
            .flat_map(|i| (i + 1..7).map(move |j| [i, j]))
            .collect();
        let wanted = super::super::paths(&pairs, false);
        let mut all: Vec<_> = (1..=4)
            .flat_map(|number| Shard { number, of: 4 }.part(&wanted, 2))
            .collect();
        assert_eq!(all[..2], [[0, 1], [1, 0]]);
        all.sort_unstable();
        let mut expected = wanted.clone();
        expected.sort_unstable();
        assert_eq!(all, expected);
        // More parts than pairs: some are empty.
        assert!(Shard { number: 9, of: 9 }.part(&wanted[..2], 2).is_empty());
    }
}
