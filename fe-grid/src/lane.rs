//! Lanes: the numbers a pointwise formula is evaluated in.
//!
//! A law written once, generic over [`Lane`], runs on a plain `f64` or `f32` in a test and on a
//! vector of neighbouring cells in production. Every basic operation is elementwise and correctly
//! rounded (fused multiply-add included), and the others are made of these, so that a lane of any
//! width gives the bits that the scalar formula gives.

use crate::half::Half;
use crate::simd_level::SimdLevel;
use std::marker::PhantomData;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// A vector of one or more floating-point numbers with elementwise arithmetic.
pub trait Lane:
    Copy
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + 'static
{
    /// The scalar type of one entry.
    type Element: Element;
    /// The result of a comparison, one truth value for every entry.
    type Mask: Copy;
    /// How many entries there are.
    const COUNT: usize;
    /// Which of the lanes that kernels are compiled for this is; none for other numbers.
    #[doc(hidden)]
    const COMPILED: Option<CompiledLane<Self>> = None;

    /// All entries equal to `x`.
    fn splat(x: f64) -> Self;
    /// Fused `self * a + b`.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Smaller of two entries; the second where one is NaN.
    fn min(self, other: Self) -> Self;
    /// Larger of two entries; the second where one is NaN.
    fn max(self, other: Self) -> Self;
    /// `self < other`.
    fn less(self, other: Self) -> Self::Mask;
    /// `mask ? yes : no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Whether a comparison is true for any entry.
    fn any(mask: Self::Mask) -> bool;
    /// `(m, e)` with `self = m 2^e` and `m` between `1/sqrt 2` and `sqrt 2`, for positive normal
    /// numbers.
    ///
    /// In the bits of a number the exponent stands above the mantissa. Adding the distance from
    /// `1/sqrt 2` to 1 before they are taken apart, and `1/sqrt 2` to the mantissa after it, moves
    /// the seam between two exponents from 1 to `1/sqrt 2`.
    fn split_exponent(self) -> (Self, Self);
    /// The first [`Lane::COUNT`] numbers of a slice; missing entries are zero.
    fn load(source: &[Self::Element]) -> Self;
    /// The first [`Lane::COUNT`] numbers of a slice of halves; missing entries are zero.
    #[inline(always)]
    fn load_halves(source: &[Half]) -> Self {
        let mut entries = [Self::Element::default(); MAX_LANES];
        for (entry, half) in entries[..Self::COUNT].iter_mut().zip(source) {
            *entry = Self::Element::from_half(*half);
        }
        Self::load(&entries)
    }
    /// The first [`Lane::COUNT`] numbers of a slice in single precision; missing entries are zero.
    #[inline(always)]
    fn load_singles(source: &[f32]) -> Self {
        let mut entries = [Self::Element::default(); MAX_LANES];
        for (entry, x) in entries[..Self::COUNT].iter_mut().zip(source) {
            *entry = Self::Element::from_f64(f64::from(*x));
        }
        Self::load(&entries)
    }
    /// Writes to the first [`Lane::COUNT`] places of a slice; entries beyond its end are dropped.
    fn store(self, target: &mut [Self::Element]);

    /// Runs a kernel in these lanes, compiled for their instruction set.
    #[doc(hidden)]
    #[inline(always)]
    fn vectorize<K: LaneKernel<Self::Element>>(kernel: K) -> K::Output {
        kernel.run::<Self>()
    }

    /// Zero in every entry.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    /// One in every entry.
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }

    /// `self * c` for a scalar constant.
    #[inline(always)]
    fn scale(self, c: f64) -> Self {
        self * Self::splat(c)
    }

    /// The largest integer not above `self`, for `|self| < 2^22`.
    #[inline(always)]
    fn floor(self) -> Self {
        // Adding 1.5 * 2^(mantissa bits) rounds to the nearest integer.
        let magic = Self::splat(<Self::Element as Element>::ROUNDING_MAGIC);
        let nearest = (self + magic) - magic;
        Self::select(self.less(nearest), nearest - Self::one(), nearest)
    }

    /// Natural logarithm, accurate to about one unit in the last place; NaN for arguments that
    /// are not positive.
    #[inline(always)]
    fn ln(self) -> Self {
        self.ln_of_one_plus(self - Self::one())
    }

    /// `ln(1 + self)`, accurate also for small `self`; NaN where `1 + self` is not positive.
    #[inline(always)]
    fn ln_1p(self) -> Self {
        (self + Self::one()).ln_of_one_plus(self)
    }

    /// `ln(self)`, where `excess = self - 1` is known without cancellation.
    ///
    /// With `self = m 2^e`, `m` in `[1/sqrt 2, sqrt 2)`, the series of `artanh` in
    /// `s = (m-1)/(m+1)` gives `ln m`; for `e = 0` the exact `excess` is used in place of `m-1`.
    #[doc(hidden)]
    #[inline(always)]
    fn ln_of_one_plus(self, excess: Self) -> Self {
        let (m, e) = self.split_exponent();
        let unscaled = e.abs().less(Self::splat(0.5));
        let f = Self::select(unscaled, excess, m - Self::one());
        let s = f / (f + Self::splat(2.0));
        let z = s * s;
        // 2 s (1 + z p): the leading term is kept apart so that it is not rounded twice.
        let two_s = s + s;
        let tail = (two_s * z).mul_add(z.artanh_excess(), two_s);
        let value = e.mul_add(Self::splat(std::f64::consts::LN_2), tail);
        Self::select(Self::zero().less(self), value, Self::splat(f64::NAN))
    }

    /// `(artanh(s)/s - 1)/s^2` for `self = s^2`, `|s| <= (sqrt 2 - 1)/(sqrt 2 + 1)`: what the
    /// logarithm of a number in `[1/sqrt 2, sqrt 2)` needs beyond its leading term.
    #[doc(hidden)]
    #[inline(always)]
    fn artanh_excess(self) -> Self {
        self.polynomial(<Self::Element as Element>::ARTANH_EXCESS)
    }

    /// Arc tangent, accurate to a few units in the last place.
    ///
    /// `|x|` is brought to `|z| <= tan(pi/8)` by `atan x = pi/4 + atan((x-1)/(x+1))` or
    /// `atan x = pi/2 - atan(1/x)`; there `atan z = z + z^3 P(z^2)/Q(z^2)`, with the coefficients of
    /// the Cephes library (S. L. Moshier).
    #[inline(always)]
    fn atan(self) -> Self {
        const P: [f64; 5] = [
            -64.850_219_049_420_25,
            -122.886_668_449_013_61,
            -75.008_557_923_147_05,
            -16.157_537_187_333_652,
            -0.875_060_860_003_190_4,
        ];
        const Q: [f64; 6] = [
            194.550_657_148_261_4,
            485.390_399_635_913_7,
            432.881_060_491_290_27,
            165.027_009_831_698_85,
            24.858_464_901_423_062,
            1.0,
        ];
        let (zero, one) = (Self::zero(), Self::one());
        let x = self.abs();
        let large = Self::splat(1.0 + std::f64::consts::SQRT_2).less(x);
        let middle = Self::splat(std::f64::consts::SQRT_2 - 1.0).less(x);
        let above = Self::select(middle, x - one, x);
        let below = Self::select(middle, x + one, one);
        let z = Self::select(large, -one, above) / Self::select(large, x, below);
        let offset = Self::select(middle, Self::splat(std::f64::consts::FRAC_PI_4), zero);
        let offset = Self::select(large, Self::splat(std::f64::consts::FRAC_PI_2), offset);
        let square = z * z;
        let tail = square * square.polynomial(&P) / square.polynomial(&Q);
        let value = offset + tail.mul_add(z, z);
        Self::select(self.less(zero), -value, value)
    }

    /// The polynomial with these coefficients, at most eight, constant first. Neighbouring terms
    /// are put together in pairs, so that few operations wait for each other (Estrin's scheme).
    #[inline(always)]
    fn polynomial(self, coefficients: &'static [f64]) -> Self {
        let mut terms = [Self::zero(); 8];
        for (term, &c) in terms.iter_mut().zip(coefficients) {
            *term = Self::splat(c);
        }
        let mut power = self;
        let mut n = coefficients.len();
        for _ in 0..3 {
            for i in 0..4 {
                if 2 * i + 1 < n {
                    terms[i] = terms[2 * i + 1].mul_add(power, terms[2 * i]);
                } else if 2 * i < n {
                    terms[i] = terms[2 * i];
                }
            }
            n = n.div_ceil(2);
            power = power * power;
        }
        terms[0]
    }

    /// `self^p` for non-negative entries. Integers and half-integers up to 64 are products and
    /// square roots; other exponents go through the scalar library function.
    #[inline(always)]
    fn powf(self, p: f64) -> Self {
        let doubled = 2.0 * p;
        if doubled.fract() == 0.0 && doubled.abs() <= 128.0 {
            let twice = doubled.abs() as u32;
            let mut result = self.powi(twice / 2);
            if twice % 2 == 1 {
                result *= self.sqrt();
            }
            if p < 0.0 {
                Self::one() / result
            } else {
                result
            }
        } else {
            self.map(|x| Self::Element::from_f64(x.to_f64().powf(p)))
        }
    }

    /// `self^n` by repeated squaring.
    #[inline(always)]
    fn powi(self, n: u32) -> Self {
        let (mut result, mut base, mut n) = (Self::one(), self, n);
        while n > 0 {
            if n % 2 == 1 {
                result *= base;
            }
            base *= base;
            n /= 2;
        }
        result
    }

    /// A scalar function applied to every entry. Slow: for rare cases.
    #[inline(always)]
    fn map(self, f: impl Fn(Self::Element) -> Self::Element) -> Self {
        let mut entries = [Self::Element::default(); MAX_LANES];
        self.store(&mut entries);
        for x in &mut entries[..Self::COUNT] {
            *x = f(*x);
        }
        Self::load(&entries)
    }
}

/// The index of `L` among the lanes that kernels are compiled for: three instruction sets for each
/// precision.
///
/// Only this crate makes values of this type, so that no two lanes have the same index.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct CompiledLane<L>(usize, PhantomData<L>);

impl<L> CompiledLane<L> {
    pub(crate) const fn new(index: usize) -> Self {
        Self(index, PhantomData)
    }

    #[inline(always)]
    pub(crate) fn index(&self) -> usize {
        self.0
    }
}

/// No lane is wider than this.
pub const MAX_LANES: usize = 16;

mod sealed {
    /// Numbers of which every pattern of bits is one.
    pub trait Plain {}

    impl Plain for f32 {}
    impl Plain for f64 {}
    impl Plain for i8 {}
    impl Plain for u16 {}
}

/// A number that long vectors are stored in. Other crates cannot implement it: vectors in files are read
/// as these numbers, whatever their bits are.
pub trait Stored:
    sealed::Plain + Copy + Default + PartialEq + Send + Sync + std::fmt::Debug + 'static
{
}

impl Stored for f32 {}
impl Stored for f64 {}
impl Stored for i8 {}
impl Stored for u16 {}

/// A scalar that fields are stored in: `f64` or `f32`.
pub trait Element: Stored + Lane<Element = Self> + PartialOrd + std::iter::Sum {
    /// `1.5 * 2^p` with `p` mantissa bits: adding it rounds to an integer.
    const ROUNDING_MAGIC: f64;
    /// `1/sqrt 2`, where [`Lane::split_exponent`] passes from one exponent to the next.
    const SEAM: Self;
    /// Coefficients in `s^2` of `(artanh(s)/s - 1)/s^2`, constant first: interpolation in the
    /// Chebyshev points of `s^2` up to `((sqrt 2 - 1)/(sqrt 2 + 1))^2`. The error in the logarithm
    /// is below a tenth of a unit in the last place.
    const ARTANH_EXCESS: &'static [f64];
    /// Rounds from double precision.
    fn from_f64(x: f64) -> Self;
    /// Widens to double precision.
    fn to_f64(self) -> f64;
    /// Widens a half.
    fn from_half(half: Half) -> Self;
    /// Numbers, with their type.
    #[doc(hidden)]
    fn numbers(numbers: &[Self]) -> Numbers<'_>;
    /// Numbers to be changed, with their type.
    #[doc(hidden)]
    fn numbers_mut(numbers: &mut [Self]) -> NumbersMut<'_>;
    /// Runs a kernel on the instruction set in use, [`SimdLevel::active`]. Builds that are not fully optimised
    /// (`opt-level` below 3) compile the kernel for scalars and for vectors of 256 bits only: copies for 512
    /// bits would give the tests the same bits, and more to compile.
    fn run_kernel<K: LaneKernel<Self>>(kernel: K) -> K::Output;
    /// Runs a kernel on a given instruction set; it is compiled for all of them in every build.
    fn dispatch<K: LaneKernel<Self>>(level: SimdLevel, kernel: K) -> K::Output;
}

/// Numbers of one of the types that fields are stored in.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub enum Numbers<'a> {
    /// Double precision.
    Double(&'a [f64]),
    /// Single precision.
    Single(&'a [f32]),
}

/// Numbers of one of these types that are changed.
#[doc(hidden)]
#[derive(Debug)]
pub enum NumbersMut<'a> {
    /// Double precision.
    Double(&'a mut [f64]),
    /// Single precision.
    Single(&'a mut [f32]),
}

/// A computation that is compiled once for each kind of lane.
pub trait LaneKernel<T: Element> {
    /// Result of the computation.
    type Output;
    /// The computation; implementations are `#[inline(always)]`, as is all that they call, so
    /// that the instruction set chosen at run time reaches them.
    fn run<L: Lane<Element = T>>(self) -> Self::Output;
}
