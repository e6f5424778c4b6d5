//! The numbers of a file; all sizes are checked before memory is allocated.

use std::path::Path;

use super::number::Meaning;
use super::values::Values;
use super::{InputError, MAX_VALUES};

/// The numbers of a file before they are read as a mask.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    /// The numbers, `x` fastest.
    pub values: Values,
    /// Samples along each axis, `x` first.
    pub size: Vec<usize>,
    /// Their interpretation.
    pub meaning: Meaning,
    /// Spacing along each axis, `x` first.
    pub spacing: Vec<f64>,
    /// Sample indices to world coordinates.
    pub affine: Option<[[f64; 4]; 3]>,
    /// Whether this is a plain array of numbers.
    pub plain_array: bool,
}

/// Bytes of a value after it has been read.
pub(crate) const VALUE: u64 = size_of::<f64>() as u64;

/// Checks a size claimed by a header: two or three axes, two samples or more along each, not too
/// many in all. `size` is `x` first. Returns the number of values.
pub(crate) fn check_size(size: &[u64], path: &Path) -> Result<usize, InputError> {
    let stored: Vec<u64> = size.iter().rev().copied().collect();
    if !matches!(size.len(), 2 | 3) {
        return Err(InputError::Axes {
            path: path.into(),
            found: size.len(),
        });
    }
    if size.iter().any(|&n| n < 2) {
        return Err(InputError::TooSmall {
            path: path.into(),
            size: stored,
        });
    }
    check_count(size, path)
}

/// Checks the number of values that a header or an array states, and returns it. `size` is `x` first.
///
/// # Errors
/// [`InputError::TooLarge`] for more than [`MAX_VALUES`].
pub fn check_count(size: &[u64], path: &Path) -> Result<usize, InputError> {
    let count = size
        .iter()
        .try_fold(1u64, |product, &n| product.checked_mul(n))
        .filter(|&count| count <= MAX_VALUES);
    match count {
        Some(count) => Ok(count as usize),
        None => Err(InputError::TooLarge {
            path: path.into(),
            size: size.iter().rev().copied().collect(),
        }),
    }
}

/// The first `expected` bytes of `found`.
pub(crate) fn take<'a>(
    bytes: &'a [u8],
    expected: usize,
    path: &Path,
) -> Result<&'a [u8], InputError> {
    bytes.get(..expected).ok_or_else(|| InputError::Truncated {
        path: path.into(),
        expected: expected as u64,
        found: bytes.len() as u64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claimed_sizes_are_checked_before_they_are_trusted() {
        let path = Path::new("claim");
        assert_eq!(check_size(&[3, 4, 5], path).unwrap(), 60);
        assert!(matches!(
            check_size(&[u64::MAX, u64::MAX], path),
            Err(InputError::TooLarge { .. })
        ));
        assert!(matches!(
            check_size(&[3, 1], path),
            Err(InputError::TooSmall { .. })
        ));
        assert!(matches!(
            check_size(&[9], path),
            Err(InputError::Axes { found: 1, .. })
        ));
    }
}
