//! Smooth steps from 0 to 1, and their derivatives.

use std::f64::consts::FRAC_1_PI;

use fe_grid::{Field, Lane, mutant};

use crate::error::LevelsetError;

/// The step with a transition of finite width: 0 for `x <= -w`, 1 for `x >= w`, between them
/// `3 s^2 - 2 s^3` with `s = (x + w)/(2 w)`. Continuously differentiable, without tails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compact {
    half_width: f64,
}

impl Compact {
    /// Creates the step with half-width `w > 0`, in the unit of its argument.
    ///
    /// # Errors
    /// [`LevelsetError::Parameter`] if the width is not positive and finite.
    pub fn new(half_width: f64) -> Result<Self, LevelsetError> {
        check("half_width", half_width)?;
        Ok(Self { half_width })
    }

    /// Returns the half-width `w`.
    pub fn half_width(self) -> f64 {
        self.half_width
    }

    /// `H(x)`, in `[0, 1]`.
    #[inline(always)]
    pub fn value<L: Lane>(self, x: L) -> L {
        let s = self.local(x);
        s * s * (L::splat(3.0) - s.scale(2.0))
    }

    /// The mean slope of the step, `1/(2 w)`.
    pub fn mean_slope(self) -> f64 {
        0.5 / self.half_width
    }

    /// `H'(x) = 6 s (1 - s)/(2 w)`.
    #[inline(always)]
    pub fn derivative<L: Lane>(self, x: L) -> L {
        let s = self.local(x);
        (s * (L::one() - s)).scale(3.0 / self.half_width)
    }

    #[inline(always)]
    fn local<L: Lane>(self, x: L) -> L {
        let half_width = mutant!(self.half_width, CompactWidth => 0.5 * self.half_width);
        let s = (x.scale(1.0 / half_width) + L::one()).scale(0.5);
        s.max(L::zero()).min(L::one())
    }
}

/// The step `H(x) = 1/2 + atan(x/epsilon)/pi`. Its tails are unbounded, so distant shapes interact.
/// Not suitable for elastic weights, as the tails would stiffen the exterior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arctan {
    width: f64,
}

impl Arctan {
    /// Creates the step with width `epsilon > 0`, in the unit of its argument.
    ///
    /// # Errors
    /// [`LevelsetError::Parameter`] if the width is not positive and finite.
    pub fn new(width: f64) -> Result<Self, LevelsetError> {
        check("width", width)?;
        Ok(Self { width })
    }

    /// Returns the width `epsilon`.
    pub fn width(self) -> f64 {
        self.width
    }

    /// `H(x)`, in `(0, 1)`.
    #[inline(always)]
    pub fn value<L: Lane>(self, x: L) -> L {
        let angle = x.scale(1.0 / self.width).atan();
        angle.scale(FRAC_1_PI) + L::splat(0.5)
    }

    /// `H'(x) = epsilon/(pi (epsilon^2 + x^2))`.
    #[inline(always)]
    pub fn derivative<L: Lane>(self, x: L) -> L {
        let s = x.scale(1.0 / self.width);
        let height = mutant!(FRAC_1_PI, ArctanSlope => 2.0 * FRAC_1_PI);
        L::splat(height / self.width) / s.mul_add(s, L::one())
    }

    /// `H''(x) = -2 epsilon x/(pi (epsilon^2 + x^2)^2)`.
    #[inline(always)]
    pub fn second_derivative<L: Lane>(self, x: L) -> L {
        let s = x.scale(1.0 / self.width);
        let below = s.mul_add(s, L::one());
        s.scale(-2.0 * FRAC_1_PI / (self.width * self.width)) / (below * below)
    }
}

/// A smooth step of either kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// With a transition of finite width.
    Compact(Compact),
    /// With tails.
    Arctan(Arctan),
}

impl Step {
    /// `H(x)`.
    #[inline(always)]
    pub fn value<L: Lane>(self, x: L) -> L {
        match self {
            Self::Compact(step) => step.value(x),
            Self::Arctan(step) => step.value(x),
        }
    }

    /// `H'(x)`.
    #[inline(always)]
    pub fn derivative<L: Lane>(self, x: L) -> L {
        match self {
            Self::Compact(step) => step.derivative(x),
            Self::Arctan(step) => step.derivative(x),
        }
    }

    /// Computes `H(x)` at every node.
    pub fn of_field<const D: usize>(self, field: &Field<f64, D, 1>) -> Field<f64, D, 1> {
        let mut out = field.clone();
        for x in out.as_mut_slice() {
            *x = self.value(*x);
        }
        out
    }
}

fn check(name: &'static str, value: f64) -> Result<(), LevelsetError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(LevelsetError::Parameter { name, value })
    }
}
