//! Values of either dimension.
//!
//! The dimension of a run is that of its inputs, and is known when these are read. From then on
//! the code is generic over it.

use std::any::Any;

/// A value in 2D or in 3D.
#[derive(Clone, Debug, PartialEq)]
pub enum Dim<A, B> {
    /// In 2D.
    D2(A),
    /// In 3D.
    D3(B),
}

impl<A, B> Dim<A, B> {
    /// The dimension.
    pub fn dimension(&self) -> usize {
        match self {
            Self::D2(_) => 2,
            Self::D3(_) => 3,
        }
    }
}

impl<A: 'static, B: 'static> Dim<A, B> {
    /// The value, if it is of this type.
    pub fn of_type<T: 'static>(self) -> Option<T> {
        let value: Box<dyn Any> = match self {
            Self::D2(value) => Box::new(value),
            Self::D3(value) => Box::new(value),
        };
        value.downcast().ok().map(|value| *value)
    }
}

/// Evaluates an expression for the value of a [`Dim`]; the result is a [`Dim`] again.
#[macro_export]
macro_rules! per_dimension {
    ($either:expr, $value:pat => $result:expr) => {
        match $either {
            $crate::dimension::Dim::D2($value) => $crate::dimension::Dim::D2($result),
            $crate::dimension::Dim::D3($value) => $crate::dimension::Dim::D3($result),
        }
    };
}

pub use crate::per_dimension;
