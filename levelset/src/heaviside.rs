//! Smooth steps from 0 to 1, and their derivatives.

use std::f64::consts::PI;

use crate::LevelsetError;

/// The step with a transition of finite width: 0 for `x <= -w`, 1 for `x >= w`, between them
/// `3 s^2 - 2 s^3` with `s = (x + w)/(2 w)`. Continuously differentiable, without tails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compact {
    half_width: f64,
}

impl Compact {
    /// The step with half-width `w > 0`, in the unit of its argument.
    ///
    /// # Errors
    /// [`LevelsetError::Parameter`] where the width is not positive and finite.
    pub fn new(half_width: f64) -> Result<Self, LevelsetError> {
        check("half_width", half_width)?;
        Ok(Self { half_width })
    }

    /// The half-width `w`.
    pub fn half_width(self) -> f64 {
        self.half_width
    }

    /// `H(x)`, in `[0, 1]`.
    pub fn value(self, x: f64) -> f64 {
        let s = self.local(x);
        s * s * (3.0 - 2.0 * s)
    }

    /// `H'(x) = 6 s (1 - s)/(2 w)`.
    pub fn derivative(self, x: f64) -> f64 {
        let s = self.local(x);
        3.0 * s * (1.0 - s) / self.half_width
    }

    fn local(self, x: f64) -> f64 {
        (0.5 * (x / self.half_width + 1.0)).clamp(0.0, 1.0)
    }
}

/// The step `H(x) = 1/2 + atan(x/epsilon)/pi`, whose tails reach everywhere: shapes far apart
/// still feel each other. Not for elastic weights, whose exterior the tails would stiffen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arctan {
    width: f64,
}

impl Arctan {
    /// The step with width `epsilon > 0`, in the unit of its argument.
    ///
    /// # Errors
    /// [`LevelsetError::Parameter`] where the width is not positive and finite.
    pub fn new(width: f64) -> Result<Self, LevelsetError> {
        check("width", width)?;
        Ok(Self { width })
    }

    /// The width `epsilon`.
    pub fn width(self) -> f64 {
        self.width
    }

    /// `H(x)`, in `(0, 1)`.
    pub fn value(self, x: f64) -> f64 {
        0.5 + (x / self.width).atan() / PI
    }

    /// `H'(x) = epsilon/(pi (epsilon^2 + x^2))`.
    pub fn derivative(self, x: f64) -> f64 {
        let s = x / self.width;
        1.0 / (PI * self.width * (1.0 + s * s))
    }

    /// `H''(x) = -2 epsilon x/(pi (epsilon^2 + x^2)^2)`.
    pub fn second_derivative(self, x: f64) -> f64 {
        let s = x / self.width;
        let below = 1.0 + s * s;
        -2.0 * s / (PI * self.width * self.width * below * below)
    }
}

fn check(name: &'static str, value: f64) -> Result<(), LevelsetError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(LevelsetError::Parameter { name, value })
    }
}
