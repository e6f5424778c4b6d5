//! Scalar functions of an excess `x` over one, without cancellation where `x` is small.

use fe_grid::{Element, Lane};

/// A power `(1 + x)^k` written as `1 + excess`, and `excess = k x + remainder`.
#[derive(Clone, Copy)]
struct Power<L> {
    excess: L,
    remainder: L,
}

impl<L: Lane> Power<L> {
    /// Returns the power with the sum of both exponents. With non-negative excesses of equal sign
    /// no
    /// term cancels: `(1+a)(1+b) = 1 + a + b + ab`, and `ab` is of second order.
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self {
            excess: self
                .excess
                .mul_add(other.excess, self.excess + other.excess),
            remainder: self
                .excess
                .mul_add(other.excess, self.remainder + other.remainder),
        }
    }

    /// `(1 + x)^n` by repeated squaring.
    #[inline(always)]
    fn integer(x: L, mut n: u32) -> Self {
        let mut base = Self {
            excess: x,
            remainder: L::zero(),
        };
        let mut result = Self {
            excess: L::zero(),
            remainder: L::zero(),
        };
        while n > 0 {
            if n % 2 == 1 {
                result = result.times(base);
            }
            base = base.times(base);
            n /= 2;
        }
        result
    }

    /// Returns `(1 + x)^(1/2)`: with `y` the excess, `y = x / (1 + sqrt(1 + x))` and
    /// `y - x/2 = -y^2/2`.
    #[inline(always)]
    fn square_root(x: L) -> Self {
        let excess = x / (L::one() + (L::one() + x).sqrt());
        Self {
            excess,
            remainder: (excess * excess).scale(-0.5),
        }
    }
}

/// Returns whether a power is computed by products and square roots.
#[inline(always)]
fn is_half_integer(k: f64) -> bool {
    (2.0 * k).fract() == 0.0 && (0.0..=64.0).contains(&k)
}

#[inline(always)]
fn half_integer_power<L: Lane>(x: L, k: f64) -> Power<L> {
    let twice = (2.0 * k) as u32;
    let whole = Power::integer(x, twice / 2);
    if twice % 2 == 1 {
        whole.times(Power::square_root(x))
    } else {
        whole
    }
}

/// `(1 + x)^k - 1` for `x >= -1`, `k >= 0`.
#[inline(always)]
pub(crate) fn power_excess<L: Lane>(x: L, k: f64) -> L {
    if is_half_integer(k) {
        half_integer_power(x, k).excess
    } else {
        x.map(|x| L::Element::from_f64((k * x.to_f64().ln_1p()).exp_m1()))
    }
}

/// `(1 + x)^k - 1 - k x` for `x >= -1`, `k >= 0`.
#[inline(always)]
pub(crate) fn power_remainder<L: Lane>(x: L, k: f64) -> L {
    if is_half_integer(k) {
        half_integer_power(x, k).remainder
    } else {
        x.map(|x| L::Element::from_f64(scalar_power_remainder(x.to_f64(), k)))
    }
}

/// Evaluates the binomial series near zero, the definition elsewhere.
fn scalar_power_remainder(x: f64, k: f64) -> f64 {
    if x.abs() * (1.0 + k) > 0.25 {
        return (k * x.ln_1p()).exp_m1() - k * x;
    }
    let mut term = k * x;
    let mut sum = 0.0;
    for j in 2..60 {
        let j = f64::from(j);
        term *= (k - j + 1.0) / j * x;
        sum += term;
        if term.abs() <= f64::EPSILON * 0.25 * f64::abs(sum) {
            break;
        }
    }
    sum
}

/// Decomposition for the logarithm of `1 + x`, up to a division: `1 + x = m 2^e` with `m` between
/// `1/sqrt 2` and `sqrt 2`, and `ln m = 2 artanh(s)` with `s = f / (f + 2)`, `f = m - 1`.
#[derive(Clone, Copy)]
pub(crate) struct LogarithmParts<L: Lane> {
    /// `e`.
    exponent: L,
    /// Whether `x` is small.
    small: L::Mask,
    /// `m - 1`.
    pub numerator: L,
    /// `m + 1`.
    pub denominator: L,
}

/// Returns whether an excess `x` is small: then `1 + x` has the exponent `e = 0`, and `x` is
/// `m - 1` with more digits than `1 + x` has.
#[inline(always)]
pub(crate) fn is_small<L: Lane>(x: L) -> L::Mask {
    x.abs().less(L::splat(0.25))
}

impl<L: Lane> LogarithmParts<L> {
    /// Creates the decomposition from `x`, whether it is small, and `total = 1 + x`; the result is
    /// valid only if `total` is positive.
    #[inline(always)]
    pub fn new(x: L, small: L::Mask, total: L) -> Self {
        let (m, exponent) = total.split_exponent();
        let numerator = L::select(small, x, m - L::one());
        Self {
            exponent,
            small,
            numerator,
            denominator: numerator + L::splat(2.0),
        }
    }

    /// `x - ln(1 + x)`, without cancellation where `x` is small, given `s`.
    ///
    /// There it is `x - 2 s - 2 s^3 p = x s - 2 s^3 p`.
    #[inline(always)]
    pub fn excess_minus_logarithm(&self, x: L, s: L) -> L {
        let z = s * s;
        let cubic = (s * z) * z.artanh_excess();
        let linear = L::select(self.small, x * s, x - (s + s));
        let unscaled = cubic.mul_add(L::splat(-2.0), linear);
        self.exponent
            .mul_add(L::splat(-std::f64::consts::LN_2), unscaled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn excess_minus_logarithm(x: f64, total: f64) -> f64 {
        let parts = LogarithmParts::new(x, is_small(x), total);
        parts.excess_minus_logarithm(x, parts.numerator / parts.denominator)
    }

    /// Taylor series of `x - ln(1+x)`, exact to rounding for small `x`.
    fn logarithm_series(x: f64) -> f64 {
        (2..30)
            .rev()
            .map(|j| (-x).powi(j) / f64::from(j))
            .sum::<f64>()
    }

    #[test]
    fn logarithm_keeps_its_digits() {
        for x in [1e-12, -1e-9, 1e-6, -1e-3, 0.01, -0.05, 0.1] {
            let expected = logarithm_series(x);
            let found = excess_minus_logarithm(x, 1.0 + x);
            // A handful of roundings.
            assert!((found - expected).abs() <= 2e-15 * expected, "{x}: {found}");
        }
        for x in [-0.999, -0.5, -0.2, 0.4, 0.5, 3.0, 1e6] {
            let expected = x - f64::ln_1p(x);
            let found = excess_minus_logarithm(x, 1.0 + x);
            assert!((found - expected).abs() <= 4e-15 * expected, "{x}: {found}");
        }
    }

    #[test]
    fn powers_agree_with_the_library() {
        for k in [0.0, 0.5, 1.0, 1.5, 2.0, 3.5, 9.0, 0.75, 1.25, 2.3] {
            for x in [-0.99, -0.4, -0.1, 0.02, 0.3, 2.0] {
                let excess = f64::powf(1.0 + x, k) - 1.0;
                let scale = 1.0 + excess.abs() + k * f64::abs(x);
                assert!(
                    (power_excess(x, k) - excess).abs() < 1e-14 * scale,
                    "{k} {x}"
                );
                let remainder = excess - k * x;
                assert!(
                    (power_remainder(x, k) - remainder).abs() < 1e-14 * scale,
                    "{k} {x}"
                );
            }
        }
    }

    #[test]
    fn powers_keep_their_digits() {
        for k in [0.5, 1.5, 2.0, 3.5, 9.0, 0.75, 1.25, 2.3] {
            for x in [1e-9, -1e-6, 1e-4] {
                // Five terms of the binomial series leave k^6 x^5 / 720 < 1e-14 relative.
                let series = |from: u32| -> f64 {
                    let mut term = 1.0;
                    let mut sum = 0.0;
                    for j in 1..7 {
                        term *= (k - f64::from(j) + 1.0) / f64::from(j) * x;
                        if j >= from {
                            sum += term;
                        }
                    }
                    sum
                };
                let (excess, remainder) = (series(1), series(2));
                assert!((power_excess(x, k) - excess).abs() < 4e-15 * excess.abs());
                assert!(
                    (power_remainder(x, k) - remainder).abs() <= 2e-14 * remainder.abs(),
                    "{k} {x}: {} {remainder}",
                    power_remainder(x, k)
                );
            }
        }
    }
}
