//! Converts raw numbers of any type to double precision.

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

    /// The numbers in double precision.
    pub(crate) fn decode(self, bytes: &[u8], little_endian: bool) -> Vec<f64> {
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
}
