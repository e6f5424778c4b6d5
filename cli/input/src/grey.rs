//! Reads the numbers of a file as grey values, whatever their range.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::decode::{Samples, VALUE, check_size};
use super::mask::{check_finite, check_spacing, shaped_any};
use super::values::Step;
use super::{AnyImage, InputError, reserve};

/// Fraction of all numbers that lie below the new 0, and above the new 1, so that a few very bright
/// voxels do not darken the rest.
const TAIL: f64 = 0.005;

/// The numbers of a file that correspond to 0 and to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GreyRange {
    /// The number for 0.
    pub low: f64,
    /// The number for 1.
    pub high: f64,
}

impl GreyRange {
    /// A number of the file on the scale from 0 to 1.
    pub fn scaled(&self, number: f64) -> f64 {
        (number - self.low) / (self.high - self.low)
    }

    /// The number of the file for a value on that scale.
    pub fn number(&self, scaled: f64) -> f64 {
        self.low + scaled * (self.high - self.low)
    }
}

/// Checks the numbers and scales them so that nearly all lie between 0 and 1; those outside are
/// kept.
pub(crate) fn into_grey_image(
    mut samples: Samples,
    path: &Path,
) -> Result<(AnyImage, GreyRange), InputError> {
    let size: Vec<u64> = samples.size.iter().map(|&n| n as u64).collect();
    check_size(&size, path)?;
    check_spacing(&samples, path)?;
    check_finite(&samples, path)?;
    // Their order is found in a copy.
    reserve(path, VALUE * samples.values.len() as u64, 0)?;
    let range = range(samples.values.to_vec()).ok_or_else(|| InputError::Blank {
        path: path.into(),
        value: samples.values.get(0),
    })?;
    samples.values.then(Step::Between(range.low, range.high));
    Ok((shaped_any(samples, path), range))
}

/// None where all numbers are the same.
fn range(mut sorted: Vec<f64>) -> Option<GreyRange> {
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len() - 1;
    let tail = (TAIL * last as f64) as usize;
    let between = |tail: usize| GreyRange {
        low: sorted[tail],
        high: sorted[last - tail],
    };
    // An object may be smaller than the tail.
    let ranges = [between(tail), between(0)];
    ranges.into_iter().find(|range| range.high > range.low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_bright_numbers_do_not_count_unless_there_are_no_others() {
        let mut values: Vec<f64> = (0..1000).map(f64::from).collect();
        values.push(1e6);
        let found = range(values.clone()).unwrap();
        assert_eq!((found.low, found.high), (5.0, 995.0));
        assert!((found.number(found.scaled(7.5)) - 7.5).abs() < 1e-12);
        let mut dark = vec![3.0; 1000];
        assert_eq!(range(dark.clone()), None);
        dark[7] = 9.0;
        let found = range(dark.clone()).unwrap();
        assert_eq!((found.low, found.high), (3.0, 9.0));
    }
}
