//! Types of the numbers in files, and what they mean.

use crate::values::{Numbers, Values};

/// The interpretation of the numbers of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Meaning {
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
pub(crate) enum NumberType {
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
    pub(crate) fn width(self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The interpretation of numbers of this type in an array without further information.
    pub(crate) fn meaning(self) -> Meaning {
        match self {
            Self::Bool => Meaning::Grey(1.0),
            Self::U8 => Meaning::Grey(255.0),
            Self::U16 => Meaning::Grey(65535.0),
            Self::F32 | Self::F64 => Meaning::Real { labels: false },
            _ => Meaning::Labels,
        }
    }

    /// The numbers in their own type; truth values are bytes.
    pub(crate) fn decode(self, bytes: &[u8], little_endian: bool) -> Numbers {
        macro_rules! numbers {
            ($type:ty) => {
                bytes
                    .chunks_exact(size_of::<$type>())
                    .map(|chunk| {
                        let mut raw = [0; size_of::<$type>()];
                        raw.copy_from_slice(chunk);
                        if little_endian {
                            <$type>::from_le_bytes(raw)
                        } else {
                            <$type>::from_be_bytes(raw)
                        }
                    })
                    .collect()
            };
        }
        match self {
            Self::Bool => Numbers::U8(bytes.iter().map(|&b| u8::from(b != 0)).collect()),
            Self::U8 => Numbers::U8(bytes.to_vec()),
            Self::I8 => Numbers::I8(numbers!(i8)),
            Self::U16 => Numbers::U16(numbers!(u16)),
            Self::I16 => Numbers::I16(numbers!(i16)),
            Self::U32 => Numbers::U32(numbers!(u32)),
            Self::I32 => Numbers::I32(numbers!(i32)),
            Self::U64 => Numbers::U64(numbers!(u64)),
            Self::I64 => Numbers::I64(numbers!(i64)),
            Self::F32 => Numbers::F32(numbers!(f32)),
            Self::F64 => Numbers::F64(numbers!(f64)),
        }
    }
}

impl NumberType {
    /// The numbers in double precision.
    pub(crate) fn doubles(self, bytes: &[u8], little_endian: bool) -> Vec<f64> {
        Values::new(self.decode(bytes, little_endian)).into_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_both_byte_orders_decode() {
        let decode = |numbers: NumberType, bytes: &[u8], little_endian| {
            Values::new(numbers.decode(bytes, little_endian))
        };
        assert_eq!(decode(NumberType::I16, &[0xfe, 0xff], true), [-2.0]);
        assert_eq!(decode(NumberType::I16, &[0xff, 0xfe], false), [-2.0]);
        let quarter = 0.25f32.to_be_bytes();
        assert_eq!(decode(NumberType::F32, &quarter, false), [0.25]);
        assert_eq!(decode(NumberType::Bool, &[0, 7], true), [0.0, 1.0]);
    }
}
