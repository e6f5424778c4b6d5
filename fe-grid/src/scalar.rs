//! One number at a time: `f64` and `f32` as lanes, and as what fields are stored in.

use crate::half::Half;
use crate::lane::{CompiledLane, Element, Lane, LaneKernel, Numbers, NumbersMut};
use crate::simd::{dispatch, run_kernel};
use crate::simd_level::SimdLevel;

macro_rules! scalar_lane {
    ($t:ty, $numbers:ident, $bits:ty, $mantissa:expr, $magic:expr, $place:expr, $series:expr) => {
        impl Lane for $t {
            type Element = $t;
            type Mask = bool;
            const COUNT: usize = 1;
            const COMPILED: Option<CompiledLane<Self>> = Some(CompiledLane::new($place));

            #[inline(always)]
            fn splat(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn mul_add(self, a: Self, b: Self) -> Self {
                <$t>::mul_add(self, a, b)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$t>::abs(self)
            }
            // The x86 definition of minimum and maximum, so that NaN takes the same way in
            // every lane.
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn less(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }
            #[inline(always)]
            fn any(mask: bool) -> bool {
                mask
            }
            #[inline(always)]
            fn split_exponent(self) -> (Self, Self) {
                let one = (1.0 as $t).to_bits();
                let seam = <$t as Element>::SEAM.to_bits();
                let moved = self.to_bits().wrapping_add(one - seam);
                let mantissa = (moved & ((1 << $mantissa) - 1)) + seam;
                let width = <$bits>::BITS - 1 - $mantissa;
                let biased = ((moved >> $mantissa) & ((1 << width) - 1)) as i32;
                let exponent = biased - (one >> $mantissa) as i32;
                (<$t>::from_bits(mantissa), exponent as $t)
            }
            #[inline(always)]
            fn load(source: &[Self]) -> Self {
                source.first().copied().unwrap_or(0.0)
            }
            #[inline(always)]
            fn store(self, target: &mut [Self]) {
                if let Some(first) = target.first_mut() {
                    *first = self;
                }
            }
        }

        impl Element for $t {
            const ROUNDING_MAGIC: f64 = $magic;
            const SEAM: Self = std::f64::consts::FRAC_1_SQRT_2 as $t;
            const ARTANH_EXCESS: &'static [f64] = $series;
            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn from_half(half: Half) -> Self {
                Self::from(half.to_single())
            }
            #[inline(always)]
            fn numbers(numbers: &[Self]) -> Numbers<'_> {
                Numbers::$numbers(numbers)
            }
            #[inline(always)]
            fn numbers_mut(numbers: &mut [Self]) -> NumbersMut<'_> {
                NumbersMut::$numbers(numbers)
            }
            #[inline]
            fn run_kernel<K: LaneKernel<Self>>(kernel: K) -> K::Output {
                run_kernel::<$t, K>(kernel)
            }
            #[inline]
            fn dispatch<K: LaneKernel<Self>>(level: SimdLevel, kernel: K) -> K::Output {
                dispatch::<$t, K>(level, kernel)
            }
        }
    };
}

scalar_lane!(
    f64,
    Double,
    u64,
    52,
    6755399441055744.0,
    0,
    &[
        0.3333333333333335,
        0.19999999999949752,
        0.14285714312987743,
        0.1111110556739754,
        0.09091444562630861,
        0.07665860800278021,
        0.07308224842521703
    ]
);
scalar_lane!(
    f32,
    Single,
    u32,
    23,
    12582912.0,
    3,
    &[0.3333334251978793, 0.1999439028301099, 0.14789974695986394]
);
