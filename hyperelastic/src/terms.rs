//! The functions of one variable of which the isotropic laws are sums.
//!
//! Each is a function `f` of the excess `x` over the value at the identity, with `f(0) = 0`, given
//! in three parts that are accurate for small `x`: `f(x) = slope x + remainder(x)`,
//! `f'(x) = slope + slope_excess(x)`, and `f''(x) = curvature(x)`.

use crate::kinematics::Volume;
use crate::scalar::{power_excess, power_remainder};
use fe_grid::{Lane, mutant};
use std::fmt::Debug;

/// A function of `|A|^2 - d` or of `|cof A|^2 - d`.
pub(crate) trait NormTerm: Copy + Send + Sync + Debug + 'static {
    /// Returns false if the function is zero, so that its evaluation can be skipped.
    fn present(&self) -> bool;
    /// Returns false if the function is linear, so that its remainder and slope excess are zero.
    #[inline(always)]
    fn curved(&self) -> bool {
        self.present()
    }
    /// `f'(0)`.
    fn slope(&self) -> f64;
    /// `f(x) - f'(0) x`.
    fn remainder<L: Lane>(&self, x: L) -> L;
    /// `f'(x) - f'(0)`.
    fn slope_excess<L: Lane>(&self, x: L) -> L;
    /// `f''(x)`.
    fn curvature<L: Lane>(&self, x: L) -> L;
}

/// A function of `det A - 1`.
pub(crate) trait VolumeTerm: Copy + Send + Sync + Debug + 'static {
    /// Whether [`VolumeTerm::remainder`] reads the logarithm of the determinant.
    const LOGARITHM: bool;
    /// `f'(0)`.
    fn slope(&self) -> f64;
    /// `f(x) - f'(0) x`.
    fn remainder<L: Lane>(&self, volume: &Volume<L>) -> L;
    /// `f'(x) - f'(0)`.
    fn slope_excess<L: Lane>(&self, volume: &Volume<L>) -> L;
    /// `f''(x)`.
    fn curvature<L: Lane>(&self, volume: &Volume<L>) -> L;
}

/// The zero function.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Absent;

impl NormTerm for Absent {
    #[inline(always)]
    fn present(&self) -> bool {
        false
    }
    #[inline(always)]
    fn slope(&self) -> f64 {
        0.0
    }
    #[inline(always)]
    fn remainder<L: Lane>(&self, _: L) -> L {
        L::zero()
    }
    #[inline(always)]
    fn slope_excess<L: Lane>(&self, _: L) -> L {
        L::zero()
    }
    #[inline(always)]
    fn curvature<L: Lane>(&self, _: L) -> L {
        L::zero()
    }
}

/// `slope x`: the squared norm itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SquaredNorm {
    pub slope: f64,
}

impl NormTerm for SquaredNorm {
    #[inline(always)]
    fn present(&self) -> bool {
        true
    }
    #[inline(always)]
    fn curved(&self) -> bool {
        false
    }
    #[inline(always)]
    fn slope(&self) -> f64 {
        self.slope
    }
    #[inline(always)]
    fn remainder<L: Lane>(&self, _: L) -> L {
        L::zero()
    }
    #[inline(always)]
    fn slope_excess<L: Lane>(&self, _: L) -> L {
        L::zero()
    }
    #[inline(always)]
    fn curvature<L: Lane>(&self, _: L) -> L {
        L::zero()
    }
}

/// `a ((d + x)^(p/2) - d^(p/2))`, a power of the norm; `p >= 2`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PowerNorm {
    /// `a d^(p/2)`.
    scale: f64,
    /// `p / 2`.
    half_exponent: f64,
    /// `1 / d`.
    inverse_dimension: f64,
}

impl PowerNorm {
    /// Creates the term `coefficient |A|^exponent`, less its value at the identity.
    pub fn new(coefficient: f64, exponent: f64, dimension: usize) -> Self {
        let d = dimension as f64;
        Self {
            scale: coefficient * d.powf(0.5 * exponent),
            half_exponent: 0.5 * exponent,
            inverse_dimension: 1.0 / d,
        }
    }
}

impl NormTerm for PowerNorm {
    #[inline(always)]
    fn present(&self) -> bool {
        self.scale != 0.0
    }
    #[inline(always)]
    fn slope(&self) -> f64 {
        self.scale * self.half_exponent * self.inverse_dimension
    }
    #[inline(always)]
    fn remainder<L: Lane>(&self, x: L) -> L {
        power_remainder(x.scale(self.inverse_dimension), self.half_exponent).scale(self.scale)
    }
    #[inline(always)]
    fn slope_excess<L: Lane>(&self, x: L) -> L {
        power_excess(x.scale(self.inverse_dimension), self.half_exponent - 1.0).scale(self.slope())
    }
    #[inline(always)]
    fn curvature<L: Lane>(&self, x: L) -> L {
        let k = self.half_exponent;
        if k == 1.0 {
            return L::zero();
        }
        (L::one() + x.scale(self.inverse_dimension))
            .powf(k - 2.0)
            .scale(self.slope() * (k - 1.0) * self.inverse_dimension)
    }
}

/// `lambda/4 (D^2 - 1) - (mu + lambda/2) ln D`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LogVolume {
    pub lambda: f64,
    pub mu: f64,
}

impl LogVolume {
    #[inline(always)]
    fn logarithm(&self) -> f64 {
        self.mu + 0.5 * self.lambda
    }
}

impl VolumeTerm for LogVolume {
    const LOGARITHM: bool = true;
    #[inline(always)]
    fn slope(&self) -> f64 {
        mutant!(-self.mu, LogdetSlope => -0.9 * self.mu)
    }
    #[inline(always)]
    fn remainder<L: Lane>(&self, volume: &Volume<L>) -> L {
        let x = volume.excess;
        (x * x).mul_add(
            L::splat(0.25 * self.lambda),
            volume.excess_minus_logarithm.scale(self.logarithm()),
        )
    }
    #[inline(always)]
    fn slope_excess<L: Lane>(&self, volume: &Volume<L>) -> L {
        volume.excess.mul_add(
            L::splat(mutant!(0.5, LogdetStress => 0.0) * self.lambda),
            volume.inverse_excess.scale(-self.logarithm()),
        )
    }
    #[inline(always)]
    fn curvature<L: Lane>(&self, volume: &Volume<L>) -> L {
        (volume.inverse * volume.inverse)
            .mul_add(L::splat(self.logarithm()), L::splat(0.5 * self.lambda))
    }
}

/// `compression D^-s + expansion D^r + c D`, less its value at the identity, where `c` is
/// determined by the given slope there. `r, s >= 1`.
///
/// The linear term has no remainder, slope excess or curvature, so `c` itself is never needed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PowerVolume {
    pub slope: f64,
    pub compression: f64,
    pub compression_exponent: f64,
    pub expansion: f64,
    pub expansion_exponent: f64,
}

impl VolumeTerm for PowerVolume {
    const LOGARITHM: bool = false;
    #[inline(always)]
    fn slope(&self) -> f64 {
        self.slope
    }
    #[inline(always)]
    fn remainder<L: Lane>(&self, volume: &Volume<L>) -> L {
        inverse_power_remainder(volume, self.compression_exponent).mul_add(
            L::splat(self.compression),
            power_remainder(volume.excess, self.expansion_exponent).scale(self.expansion),
        )
    }
    #[inline(always)]
    fn slope_excess<L: Lane>(&self, volume: &Volume<L>) -> L {
        let (s, r) = (self.compression_exponent, self.expansion_exponent);
        power_excess(volume.inverse_excess, s + 1.0).mul_add(
            L::splat(-s * self.compression),
            power_excess(volume.excess, r - 1.0).scale(r * self.expansion),
        )
    }
    #[inline(always)]
    fn curvature<L: Lane>(&self, volume: &Volume<L>) -> L {
        let (s, r) = (self.compression_exponent, self.expansion_exponent);
        volume.inverse.powf(s + 2.0).mul_add(
            L::splat(s * (s + 1.0) * self.compression),
            volume
                .determinant
                .powf(r - 2.0)
                .scale(r * (r - 1.0) * self.expansion),
        )
    }
}

/// A logarithmic term plus `(b/p) (D^p + D^-p - 2)`, whose slope at the identity is zero; `p >= 1`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BarrierVolume {
    pub logarithmic: LogVolume,
    pub weight: f64,
    pub exponent: f64,
}

impl VolumeTerm for BarrierVolume {
    const LOGARITHM: bool = true;
    #[inline(always)]
    fn slope(&self) -> f64 {
        self.logarithmic.slope()
    }
    #[inline(always)]
    fn remainder<L: Lane>(&self, volume: &Volume<L>) -> L {
        let both = power_remainder(volume.excess, self.exponent)
            + inverse_power_remainder(volume, self.exponent);
        both.mul_add(
            L::splat(self.weight / self.exponent),
            self.logarithmic.remainder(volume),
        )
    }
    #[inline(always)]
    fn slope_excess<L: Lane>(&self, volume: &Volume<L>) -> L {
        let difference = power_excess(volume.excess, self.exponent - 1.0)
            - power_excess(volume.inverse_excess, self.exponent + 1.0);
        difference.mul_add(L::splat(self.weight), self.logarithmic.slope_excess(volume))
    }
    #[inline(always)]
    fn curvature<L: Lane>(&self, volume: &Volume<L>) -> L {
        let p = self.exponent;
        let both = volume.determinant.powf(p - 2.0).mul_add(
            L::splat(p - 1.0),
            volume.inverse.powf(p + 2.0).scale(p + 1.0),
        );
        both.mul_add(L::splat(self.weight), self.logarithmic.curvature(volume))
    }
}

/// `D^-s - 1 + s (D - 1)`. With `1/D = 1 + y`, `y + (D - 1) = -(D - 1) y`, a sum of two terms that
/// are never negative.
#[inline(always)]
fn inverse_power_remainder<L: Lane>(volume: &Volume<L>, s: f64) -> L {
    let y = volume.inverse_excess;
    (volume.excess * y).mul_add(L::splat(-s), power_remainder(y, s))
}
