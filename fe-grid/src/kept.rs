//! Numbers that are kept as they are or in halves.

use crate::half::Half;
use crate::lane::{Element, Lane};
use std::borrow::Cow;

/// Numbers as they are or in halves.
pub(crate) enum Kept<T> {
    Whole(Vec<T>),
    Halves(Vec<Half>),
}

impl<T: Element> Kept<T> {
    /// Keeps numbers in halves.
    pub fn in_halves(numbers: &[T]) -> Self {
        let half = |x: &T| Half::of(x.to_f64() as f32);
        Self::Halves(numbers.iter().map(half).collect())
    }

    /// The numbers, taken out.
    pub fn take(&mut self) -> Vec<T> {
        match std::mem::replace(self, Self::Whole(Vec::new())) {
            Self::Whole(numbers) => numbers,
            Self::Halves(halves) => Self::Halves(halves).numbers().into_owned(),
        }
    }

    /// The numbers; halves are widened.
    pub fn numbers(&self) -> Cow<'_, [T]> {
        match self {
            Self::Whole(numbers) => numbers.into(),
            Self::Halves(halves) => {
                let wide = |half: &Half| T::from_f64(f64::from(half.to_single()));
                halves.iter().map(wide).collect::<Vec<T>>().into()
            }
        }
    }
}

/// A slice of [`Kept`] numbers.
#[derive(Clone, Copy)]
pub(crate) enum KeptSlice<'a, T> {
    Whole(&'a [T]),
    Halves(&'a [Half]),
}

impl<T: Element> KeptSlice<'_, T> {
    /// The numbers from a place on; missing entries are zero.
    #[inline(always)]
    pub fn load_from<L: Lane<Element = T>>(&self, place: usize) -> L {
        match self {
            Self::Whole(numbers) => L::load(&numbers[place..]),
            Self::Halves(halves) => L::load_halves(&halves[place..]),
        }
    }
}
