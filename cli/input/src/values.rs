//! The values of an image: the numbers of its file in their own type, and what they mean.
//!
//! A mask of bytes takes a byte a sample until it is sampled on a grid. What becomes of a number, such as a
//! division by the full range, is done each time that a value is asked for.

/// Numbers of one type.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Numbers {
    U8(Vec<u8>),
    I8(Vec<i8>),
    U16(Vec<u16>),
    I16(Vec<i16>),
    U32(Vec<u32>),
    I32(Vec<i32>),
    U64(Vec<u64>),
    I64(Vec<i64>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// The same for numbers of every type.
macro_rules! each {
    ($numbers:expr, $v:ident => $result:expr) => {
        match $numbers {
            Numbers::U8($v) => $result,
            Numbers::I8($v) => $result,
            Numbers::U16($v) => $result,
            Numbers::I16($v) => $result,
            Numbers::U32($v) => $result,
            Numbers::I32($v) => $result,
            Numbers::U64($v) => $result,
            Numbers::I64($v) => $result,
            Numbers::F32($v) => $result,
            Numbers::F64($v) => $result,
        }
    };
}

/// The same for numbers of every type, which makes numbers of that type.
macro_rules! same_type {
    ($numbers:expr, $v:ident => $result:expr) => {
        match $numbers {
            Numbers::U8($v) => Numbers::U8($result),
            Numbers::I8($v) => Numbers::I8($result),
            Numbers::U16($v) => Numbers::U16($result),
            Numbers::I16($v) => Numbers::I16($result),
            Numbers::U32($v) => Numbers::U32($result),
            Numbers::I32($v) => Numbers::I32($result),
            Numbers::U64($v) => Numbers::U64($result),
            Numbers::I64($v) => Numbers::I64($result),
            Numbers::F32($v) => Numbers::F32($result),
            Numbers::F64($v) => Numbers::F64($result),
        }
    };
}

impl Numbers {
    pub fn len(&self) -> usize {
        each!(self, v => v.len())
    }

    /// In double precision, which rounds integers beyond 2^53.
    #[inline]
    #[allow(
        clippy::cast_lossless,
        clippy::unnecessary_cast,
        reason = "the same for all types"
    )]
    fn get(&self, index: usize) -> f64 {
        each!(self, v => v[index] as f64)
    }

    /// The numbers at these places, in their order.
    pub fn permuted(&self, place: impl Fn(usize) -> usize) -> Self {
        same_type!(self, v => (0..v.len()).map(|i| v[place(i)]).collect())
    }

    /// Numbers of the same type are put behind each other; others become double precision.
    pub fn append(&mut self, other: Self) {
        match (&mut *self, other) {
            (Self::U8(v), Self::U8(w)) => v.extend(w),
            (Self::U16(v), Self::U16(w)) => v.extend(w),
            (Self::I16(v), Self::I16(w)) => v.extend(w),
            (Self::F32(v), Self::F32(w)) => v.extend(w),
            (_, other) => {
                let all = [&*self, &other];
                let all = all.into_iter().flat_map(|n| (0..n.len()).map(|i| n.get(i)));
                *self = Self::F64(all.collect());
            }
        }
    }
}

/// What becomes of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Step {
    /// `slope x + shift`.
    Scaled(f64, f64),
    /// Divided by the full range.
    Divided(f64),
    /// Between 0 and 1.
    Clamped,
    /// 0 for the first number, 1 for the second, and linear between and beyond.
    Between(f64, f64),
    /// `1 - x`.
    Reversed,
}

impl Step {
    #[inline]
    fn of(self, x: f64) -> f64 {
        match self {
            Self::Scaled(slope, shift) => slope * x + shift,
            Self::Divided(full) => x / full,
            Self::Clamped => x.clamp(0.0, 1.0),
            Self::Between(low, high) => (x - low) / (high - low),
            Self::Reversed => 1.0 - x,
        }
    }
}

/// The values of an image, `x` fastest.
#[derive(Clone, Debug)]
pub struct Values {
    numbers: Numbers,
    steps: Vec<Step>,
}

impl Values {
    pub(crate) fn new(numbers: Numbers) -> Self {
        let steps = Vec::new();
        Self { numbers, steps }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value at a position in memory.
    ///
    /// # Panics
    /// Where there are not so many.
    #[inline]
    pub fn get(&self, index: usize) -> f64 {
        let number = self.numbers.get(index);
        self.steps.iter().fold(number, |x, step| step.of(x))
    }

    /// All values.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = f64> {
        (0..self.len()).map(|index| self.get(index))
    }

    /// All values in double precision.
    pub fn to_vec(&self) -> Vec<f64> {
        self.iter().collect()
    }

    /// All values in double precision, in place where they are so already.
    pub fn into_vec(self) -> Vec<f64> {
        match self.numbers {
            Numbers::F64(values) if self.steps.is_empty() => values,
            _ => self.to_vec(),
        }
    }

    /// `1 - x` for every value `x`.
    pub fn reverse(&mut self) {
        self.then(Step::Reversed);
    }

    /// Lets something become of every value.
    pub(crate) fn then(&mut self, step: Step) {
        self.steps.push(step);
    }

    /// 1 where a value has a property, and 0 elsewhere, in bytes.
    pub(crate) fn threshold(&mut self, object: impl Fn(f64) -> bool) {
        let value = |x: f64| {
            let value = self.steps.iter().fold(x, |x, step| step.of(x));
            u8::from(object(value))
        };
        self.numbers = Numbers::U8(
            match std::mem::replace(&mut self.numbers, Numbers::U8(vec![])) {
                Numbers::U8(mut bytes) => {
                    for x in &mut bytes {
                        *x = value((*x).into());
                    }
                    bytes
                }
                other => (0..other.len()).map(|i| value(other.get(i))).collect(),
            },
        );
        self.steps.clear();
    }
}

impl From<Vec<f64>> for Values {
    fn from(values: Vec<f64>) -> Self {
        Self::new(Numbers::F64(values))
    }
}

impl From<Vec<u8>> for Values {
    fn from(values: Vec<u8>) -> Self {
        Self::new(Numbers::U8(values))
    }
}

impl<T: AsRef<[f64]>> PartialEq<T> for Values {
    fn eq(&self, other: &T) -> bool {
        self.iter().eq(other.as_ref().iter().copied())
    }
}

impl PartialEq<Values> for Values {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_double_precision_at_the_size_of_their_type() {
        let mut values = Values::from(vec![0u8, 51, 255]);
        values.then(Step::Divided(255.0));
        assert_eq!(values.to_vec(), [0.0, 51.0 / 255.0, 1.0]);
        values.then(Step::Reversed);
        assert_eq!(values, [1.0, 1.0 - 51.0 / 255.0, 0.0]);
        values.threshold(|x| x > 0.5);
        assert_eq!(values.numbers, Numbers::U8(vec![1, 1, 0]));
        let mut scaled = Values::new(Numbers::I16(vec![-3, 40]));
        scaled.then(Step::Scaled(0.5, 1.0));
        scaled.then(Step::Clamped);
        assert_eq!(scaled, [0.0, 1.0]);
        scaled.threshold(|x| x == 1.0);
        assert_eq!(scaled.numbers, Numbers::U8(vec![0, 1]));
        let mut grey = Values::new(Numbers::F32(vec![1.5]));
        grey.then(Step::Between(1.0, 3.0));
        assert_eq!(grey.into_vec(), [0.25]);
    }

    #[test]
    fn numbers_are_permuted_and_joined() {
        let mut numbers = Numbers::U16(vec![5, 6]).permuted(|i| 1 - i);
        assert_eq!(numbers, Numbers::U16(vec![6, 5]));
        numbers.append(Numbers::U16(vec![7]));
        assert_eq!(numbers, Numbers::U16(vec![6, 5, 7]));
        numbers.append(Numbers::F32(vec![0.5]));
        assert_eq!(numbers, Numbers::F64(vec![6.0, 5.0, 7.0, 0.5]));
    }
}
