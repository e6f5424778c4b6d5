//! Wide lanes, chosen at run time.
//!
//! The instruction set is found when the program runs (crate `pulp`); no compiler flag is asked
//! of the user. The types below stay private to the crate: a value of one exists only inside
//! [`dispatch`], on a machine that has been found to support it.
//!
//! **Invariant:** wide lanes are named only inside of `dispatch`, which has seen that the machine has their
//! instruction set; a whole register is read or written only where the slice is that long.

use crate::lane::{CompiledLane, Element, Lane, LaneKernel};
use crate::simd_level::SimdLevel;
use pulp::{Simd, WithSimd, cast};
use std::marker::PhantomData;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

struct Run<T, K>(K, PhantomData<T>);

impl<K: LaneKernel<f64>> WithSimd for Run<f64, K> {
    type Output = K::Output;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.0.run::<Wide64<S>>()
    }
}

impl<K: LaneKernel<f32>> WithSimd for Run<f32, K> {
    type Output = K::Output;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.0.run::<Wide32<S>>()
    }
}

/// See [`Element::run_kernel`].
#[allow(private_bounds)]
pub(crate) fn run_kernel<T, K>(kernel: K) -> K::Output
where
    T: Element,
    K: LaneKernel<T>,
    Run<T, K>: WithSimd<Output = K::Output>,
{
    let level = SimdLevel::active();
    if cfg!(fully_optimised) {
        dispatch(level, kernel)
    } else {
        up_to_256_bits(level, kernel)
    }
}

/// See [`Element::dispatch`].
#[allow(private_bounds)]
pub(crate) fn dispatch<T, K>(level: SimdLevel, kernel: K) -> K::Output
where
    T: Element,
    K: LaneKernel<T>,
    Run<T, K>: WithSimd<Output = K::Output>,
{
    #[cfg(target_arch = "x86_64")]
    if level == SimdLevel::Widest
        && let Some(simd) = pulp::x86::V4::try_new()
    {
        return Simd::vectorize(simd, Run(kernel, PhantomData));
    }
    up_to_256_bits(level, kernel)
}

fn up_to_256_bits<T, K>(level: SimdLevel, kernel: K) -> K::Output
where
    T: Element,
    K: LaneKernel<T>,
    Run<T, K>: WithSimd<Output = K::Output>,
{
    #[cfg(target_arch = "x86_64")]
    if level >= SimdLevel::Wide256
        && let Some(simd) = pulp::x86::V3::try_new()
    {
        return Simd::vectorize(simd, Run(kernel, PhantomData));
    }
    #[cfg(not(target_arch = "x86_64"))]
    if level > SimdLevel::Scalar {
        return pulp::Arch::new().dispatch(Run(kernel, PhantomData));
    }
    kernel.run::<T>()
}

/// How many lanes kernels are compiled for.
pub(crate) const COMPILED_LANES: usize = 6;

/// The place of a wide lane after the scalar one, which stands at `first`: vectors of 512 bits come
/// after all others.
const fn compiled_lane<L>(first: usize, bytes: usize) -> CompiledLane<L> {
    CompiledLane::new(first + if bytes == 64 { 2 } else { 1 })
}

/// What is done for each of the lanes that kernels are compiled for.
pub(crate) trait LaneVisitor {
    /// It is done for one.
    fn visit<L: Lane>(&mut self);
}

/// Visits the lanes that a kernel of this program may run on, of one scalar type.
pub(crate) trait VisitLanes {
    /// Visits them.
    fn visit_lanes<V: LaneVisitor>(visitor: &mut V);
}

macro_rules! visit_lanes {
    ($t:ty, $lane:ident) => {
        impl VisitLanes for $t {
            fn visit_lanes<V: LaneVisitor>(visitor: &mut V) {
                visitor.visit::<$t>();
                #[cfg(target_arch = "x86_64")]
                {
                    visitor.visit::<$lane<pulp::x86::V3>>();
                    visitor.visit::<$lane<pulp::x86::V4>>();
                }
                #[cfg(not(target_arch = "x86_64"))]
                {
                    struct Native<'a, V>(&'a mut V);
                    impl<V: LaneVisitor> WithSimd for Native<'_, V> {
                        type Output = ();
                        fn with_simd<S: Simd>(self, _: S) {
                            self.0.visit::<$lane<S>>();
                        }
                    }
                    pulp::Arch::new().dispatch(Native(visitor));
                }
            }
        }
    };
}

visit_lanes!(f64, Wide64);
visit_lanes!(f32, Wide32);

/// The instruction-set token: a type without data, so that one can be made from nothing.
#[inline(always)]
fn token<S: Simd>() -> S {
    const { assert!(size_of::<S>() == 0) };
    // SAFETY: `S` has no bytes. That the machine supports it is known, because the lanes that
    // call this are named only under `dispatch`, which was handed such a token.
    unsafe { std::mem::transmute_copy(&()) }
}

macro_rules! wide_lane {
    ($name:ident, $t:ty, $vector:ident, $mask:ident, $m:ident) => {
        /// A register of numbers on the instruction set `S`.
        #[derive(Clone, Copy)]
        pub(crate) struct $name<S: Simd>(S::$vector);


        wide_lane!(@operator $name, Add, add, AddAssign, add_assign, $m, add);
        wide_lane!(@operator $name, Sub, sub, SubAssign, sub_assign, $m, sub);
        wide_lane!(@operator $name, Mul, mul, MulAssign, mul_assign, $m, mul);

        impl<S: Simd> Div for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn div(self, other: Self) -> Self {
                Self($m!(S, div, self.0, other.0))
            }
        }
        impl<S: Simd> Neg for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self($m!(S, neg, self.0))
            }
        }
    };
    (@operator $name:ident, $op:ident, $f:ident, $assign:ident, $g:ident, $m:ident, $call:ident) => {
        impl<S: Simd> $op for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: Self) -> Self {
                Self($m!(S, $call, self.0, other.0))
            }
        }
        impl<S: Simd> $assign for $name<S> {
            #[inline(always)]
            fn $g(&mut self, other: Self) {
                *self = Self($m!(S, $call, self.0, other.0));
            }
        }
    };
}

macro_rules! call64 {
    ($s:ty, add, $a:expr, $b:expr) => {
        token::<$s>().add_f64s($a, $b)
    };
    ($s:ty, sub, $a:expr, $b:expr) => {
        token::<$s>().sub_f64s($a, $b)
    };
    ($s:ty, mul, $a:expr, $b:expr) => {
        token::<$s>().mul_f64s($a, $b)
    };
    ($s:ty, div, $a:expr, $b:expr) => {
        token::<$s>().div_f64s($a, $b)
    };
    ($s:ty, neg, $a:expr) => {
        token::<$s>().neg_f64s($a)
    };
}
macro_rules! call32 {
    ($s:ty, add, $a:expr, $b:expr) => {
        token::<$s>().add_f32s($a, $b)
    };
    ($s:ty, sub, $a:expr, $b:expr) => {
        token::<$s>().sub_f32s($a, $b)
    };
    ($s:ty, mul, $a:expr, $b:expr) => {
        token::<$s>().mul_f32s($a, $b)
    };
    ($s:ty, div, $a:expr, $b:expr) => {
        token::<$s>().div_f32s($a, $b)
    };
    ($s:ty, neg, $a:expr) => {
        token::<$s>().neg_f32s($a)
    };
}

wide_lane!(Wide64, f64, f64s, m64s, call64);
wide_lane!(Wide32, f32, f32s, m32s, call32);

/// Loads and stores shared by both precisions: whole registers without a mask where the slice is
/// long enough, which is the case everywhere but at the end of a row.
macro_rules! memory {
    ($vector:ident, $partial_load:ident, $partial_store:ident) => {
        #[inline(always)]
        fn load(source: &[Self::Element]) -> Self {
            if source.len() >= Self::COUNT {
                // SAFETY: the slice holds at least one register's worth of plain numbers.
                Self(unsafe { source.as_ptr().cast::<S::$vector>().read_unaligned() })
            } else {
                Self(token::<S>().$partial_load(source))
            }
        }
        #[inline(always)]
        fn store(self, target: &mut [Self::Element]) {
            if target.len() >= Self::COUNT {
                // SAFETY: the slice has room for one register.
                unsafe {
                    target
                        .as_mut_ptr()
                        .cast::<S::$vector>()
                        .write_unaligned(self.0)
                }
            } else {
                token::<S>().$partial_store(target, self.0);
            }
        }
    };
}

impl<S: Simd> Lane for Wide64<S> {
    type Element = f64;
    type Mask = S::m64s;
    const COUNT: usize = S::F64_LANES;
    const COMPILED: Option<CompiledLane<Self>> = Some(compiled_lane(0, size_of::<S::f64s>()));

    #[inline(always)]
    fn vectorize<K: LaneKernel<f64>>(kernel: K) -> K::Output {
        token::<S>().vectorize(Run(kernel, PhantomData))
    }

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(token::<S>().splat_f64s(x))
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(token::<S>().mul_add_f64s(self.0, a.0, b.0))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(token::<S>().sqrt_f64s(self.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(token::<S>().abs_f64s(self.0))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.less(other), self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.less(self), self, other)
    }
    #[inline(always)]
    fn less(self, other: Self) -> Self::Mask {
        token::<S>().less_than_f64s(self.0, other.0)
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self(token::<S>().select_f64s(mask, yes.0, no.0))
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        // The count of entries where none is true; which one is the first is not asked.
        token::<S>().first_true_m64s(mask) < Self::COUNT
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let s = token::<S>();
        let (one, seam) = (1.0f64.to_bits(), f64::SEAM.to_bits());
        let moved = s.add_u64s(cast(self.0), s.splat_u64s(one - seam));
        let mantissa = s.add_u64s(
            s.and_u64s(moved, s.splat_u64s((1 << 52) - 1)),
            s.splat_u64s(seam),
        );
        // There is no shift of 64-bit lanes: shift the 32-bit halves and keep the upper one, the
        // exponent times 2^32; or-ing the bits of 2^52 makes it the float 2^52 + e 2^32.
        let halves = s.wrapping_dyn_shr_u32s(cast(moved), s.splat_u32s(20));
        let upper = s.and_u64s(cast(halves), s.splat_u64s(0x7ff << 32));
        let shifted: S::f64s = cast(s.or_u64s(upper, s.splat_u64s((2.0f64).powi(52).to_bits())));
        let bias = s.splat_f64s((2.0f64).powi(52) + 1023.0 * (2.0f64).powi(32));
        let exponent = s.mul_f64s(s.sub_f64s(shifted, bias), s.splat_f64s((2.0f64).powi(-32)));
        (Self(cast(mantissa)), Self(exponent))
    }
    memory!(f64s, partial_load_f64s, partial_store_f64s);
}

impl<S: Simd> Lane for Wide32<S> {
    type Element = f32;
    type Mask = S::m32s;
    const COUNT: usize = S::F32_LANES;
    const COMPILED: Option<CompiledLane<Self>> = Some(compiled_lane(3, size_of::<S::f32s>()));

    #[inline(always)]
    fn vectorize<K: LaneKernel<f32>>(kernel: K) -> K::Output {
        token::<S>().vectorize(Run(kernel, PhantomData))
    }

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(token::<S>().splat_f32s(x as f32))
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(token::<S>().mul_add_f32s(self.0, a.0, b.0))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(token::<S>().sqrt_f32s(self.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(token::<S>().abs_f32s(self.0))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.less(other), self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.less(self), self, other)
    }
    #[inline(always)]
    fn less(self, other: Self) -> Self::Mask {
        token::<S>().less_than_f32s(self.0, other.0)
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self(token::<S>().select_f32s(mask, yes.0, no.0))
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        // The count of entries where none is true; which one is the first is not asked.
        token::<S>().first_true_m32s(mask) < Self::COUNT
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let s = token::<S>();
        let (one, seam) = (1.0f32.to_bits(), f32::SEAM.to_bits());
        let moved = s.add_u32s(cast(self.0), s.splat_u32s(one - seam));
        let mantissa = s.add_u32s(
            s.and_u32s(moved, s.splat_u32s((1 << 23) - 1)),
            s.splat_u32s(seam),
        );
        let shifted = s.and_u32s(
            s.wrapping_dyn_shr_u32s(moved, s.splat_u32s(23)),
            s.splat_u32s(0xff),
        );
        let float: S::f32s = cast(s.or_u32s(shifted, s.splat_u32s((2.0f32).powi(23).to_bits())));
        let exponent = s.sub_f32s(float, s.splat_f32s((2.0f32).powi(23) + 127.0));
        (Self(cast(mantissa)), Self(exponent))
    }
    memory!(f32s, partial_load_f32s, partial_store_f32s);
}
