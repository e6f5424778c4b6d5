//! Converts raw numbers of any type to double precision; all sizes are checked before memory is
//! allocated.

use std::path::Path;

use super::{InputError, MAX_VALUES};

/// The numbers of a file before they are read as a mask.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    /// The numbers, `x` fastest.
    pub values: Vec<f64>,
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

/// The interpretation of the numbers of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meaning {
    /// Grey values from 0 to this number.
    Grey(f64),
    /// Labels: every number but 0 is the object.
    Labels,
    /// Floating-point grey values; `labels` says that whole numbers may be labels.
    Real {
        /// Whole numbers outside `[0, 1]` are labels.
        labels: bool,
    },
}

/// Type of the numbers in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    Bool,
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl NumberType {
    /// Bytes a number.
    pub(super) fn width(self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The interpretation of numbers of this type in an array without further information.
    pub(super) fn meaning(self) -> Meaning {
        match self {
            Self::Bool => Meaning::Grey(1.0),
            Self::U8 => Meaning::Grey(255.0),
            Self::U16 => Meaning::Grey(65535.0),
            Self::F32 | Self::F64 => Meaning::Real { labels: false },
            _ => Meaning::Labels,
        }
    }

    /// The numbers in double precision.
    pub(super) fn decode(self, bytes: &[u8], little_endian: bool) -> Vec<f64> {
        macro_rules! numbers {
            ($type:ty, $convert:expr) => {
                bytes
                    .chunks_exact(size_of::<$type>())
                    .map(|chunk| {
                        let mut raw = [0; size_of::<$type>()];
                        raw.copy_from_slice(chunk);
                        let convert = $convert;
                        convert(if little_endian {
                            <$type>::from_le_bytes(raw)
                        } else {
                            <$type>::from_be_bytes(raw)
                        })
                    })
                    .collect()
            };
        }
        match self {
            Self::Bool => bytes.iter().map(|&b| f64::from(u8::from(b != 0))).collect(),
            Self::U8 => numbers!(u8, f64::from),
            Self::I8 => numbers!(i8, f64::from),
            Self::U16 => numbers!(u16, f64::from),
            Self::I16 => numbers!(i16, f64::from),
            Self::U32 => numbers!(u32, f64::from),
            Self::I32 => numbers!(i32, f64::from),
            Self::U64 => numbers!(u64, |x: u64| x as f64),
            Self::I64 => numbers!(i64, |x: i64| x as f64),
            Self::F32 => numbers!(f32, f64::from),
            Self::F64 => numbers!(f64, std::convert::identity),
        }
    }
}

/// Bytes of a value after it has been read.
pub(super) const VALUE: u64 = size_of::<f64>() as u64;

/// Checks a size claimed by a header: two or three axes, two samples or more along each, not too
/// many in all. `size` is `x` first. Returns the number of values.
pub(super) fn check_size(size: &[u64], path: &Path) -> Result<usize, InputError> {
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

/// Checks the number of values claimed by a header, and returns it. `size` is `x` first.
pub(super) fn check_count(size: &[u64], path: &Path) -> Result<usize, InputError> {
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
pub(super) fn take<'a>(
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
    fn numbers_of_both_byte_orders_decode() {
        assert_eq!(NumberType::I16.decode(&[0xfe, 0xff], true), [-2.0]);
        assert_eq!(NumberType::I16.decode(&[0xff, 0xfe], false), [-2.0]);
        assert_eq!(
            NumberType::F32.decode(&0.25f32.to_be_bytes(), false),
            [0.25]
        );
        assert_eq!(NumberType::Bool.decode(&[0, 7], true), [0.0, 1.0]);
    }

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
