//! The mismatch between a phase field `v_i` and the average phase field composed with a
//! deformation.
//!
//! ```text
//! F = (1/epsilon) int (v o phi)^2 (1 - v_i)^2 + v_i^2 (1 - v o phi)^2
//! ```
//!
//! is small where the zeros of `v o phi` and of `v_i` agree. It is quadratic in `v`:
//! `F = (1/epsilon) int a (v o phi)^2 - 2 b (v o phi) + b` with `a = (1 - v_i)^2 + v_i^2` and
//! `b = v_i^2`, which gives the normal equations for the average.

use fe_grid::composition::MatchDensity;
use fe_grid::engine::MAX_COEFFICIENTS;
use fe_grid::scatter::PointWeights;
use fe_grid::{Lane, Point, Reads, mutant};

/// The density of `scale * F`, with coefficient 0 the phase field `v_i`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mismatch {
    /// Interface width `epsilon`.
    pub interface_width: f64,
    /// Factor of the mismatch.
    pub scale: f64,
}

impl Mismatch {
    #[inline(always)]
    fn factor<L: Lane>(&self) -> L {
        L::splat(mutant!(1.0, MismatchDoubled => 2.0) * self.scale / self.interface_width)
    }
}

impl MatchDensity for Mismatch {
    const COEFFICIENTS: usize = 1;

    #[inline(always)]
    fn value<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> L {
        let v = coefficient[0];
        let (missing, surplus) = (s * (L::one() - v), v * (L::one() - s));
        let surplus = mutant!(surplus, MismatchSurplus => L::zero());
        missing.mul_add(missing, surplus * surplus) * self.factor()
    }

    #[inline(always)]
    fn derivatives<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> (L, L, L) {
        let v = coefficient[0];
        let twice = self.factor::<L>().scale(2.0);
        let (missing, surplus) = ((L::one() - v) * (L::one() - v), v * v);
        let slope = (missing * s - surplus * (L::one() - s)) * twice;
        let slope = mutant!(slope, MismatchSlope => slope.scale(0.5));
        (
            self.value(s, coefficient),
            slope,
            (missing + surplus) * twice,
        )
    }
}

impl Reads for Mismatch {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> PointWeights<D> for Mismatch {
    #[inline(always)]
    fn weights<L: Lane>(&self, point: &Point<L, D, D>, _deformed: &[L; D]) -> (L, L) {
        let v = point.coefficient[0];
        let (missing, surplus) = ((L::one() - v) * (L::one() - v), v * v);
        let load = mutant!(surplus, MismatchLoad => surplus.scale(0.5));
        ((missing + surplus) * self.factor(), load * self.factor())
    }
}

/// The least mismatch of a phase field with any other one,
///
/// ```text
/// (1/epsilon) int v_i^2 (1 - v_i)^2 / (v_i^2 + (1 - v_i)^2),
/// ```
///
/// with coefficient 0 the phase field `v_i`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastMismatch {
    /// Interface width `epsilon`.
    pub interface_width: f64,
}

impl MatchDensity for LeastMismatch {
    const COEFFICIENTS: usize = 1;

    #[inline(always)]
    fn value<L: Lane>(&self, _s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> L {
        let v = coefficient[0];
        let (one, other) = (v * v, (L::one() - v) * (L::one() - v));
        let sum = mutant!(one + other, LeastMismatch => L::splat(0.5));
        (one * other / sum).scale(1.0 / self.interface_width)
    }

    #[inline(always)]
    fn derivatives<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> (L, L, L) {
        (self.value(s, coefficient), L::zero(), L::zero())
    }
}

/// A density multiplied by a visibility mask, which is an additional coefficient after those of the
/// density itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Masked<F>(pub F);

impl<F: MatchDensity> MatchDensity for Masked<F> {
    const COEFFICIENTS: usize = F::COEFFICIENTS + 1;

    #[inline(always)]
    fn value<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> L {
        self.0.value(s, coefficient) * coefficient[F::COEFFICIENTS]
    }

    #[inline(always)]
    fn derivatives<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> (L, L, L) {
        let visibility = coefficient[F::COEFFICIENTS];
        let (value, slope, curvature) = self.0.derivatives(s, coefficient);
        (
            value * visibility,
            slope * visibility,
            curvature * visibility,
        )
    }
}

impl<F: Reads> Reads for Masked<F> {
    const USES_VALUE: bool = F::USES_VALUE;
    const USES_GRADIENT: bool = F::USES_GRADIENT;
    const COEFFICIENTS: usize = F::COEFFICIENTS + 1;
    const CELL_DATA: usize = F::CELL_DATA;
}

impl<F: PointWeights<D>, const D: usize> PointWeights<D> for Masked<F> {
    #[inline(always)]
    fn weights<L: Lane>(&self, point: &Point<L, D, D>, deformed: &[L; D]) -> (L, L) {
        let visibility = point.coefficient[F::COEFFICIENTS];
        let (square, load) = self.0.weights(point, deformed);
        (square * visibility, load * visibility)
    }
}
