//! Every lane gives the bits of the scalar formula, and the functions are accurate.

use fe_grid::{Element, Lane, LaneKernel, SimdLevel};
use proptest::prelude::*;

struct Functions<'a, T>(&'a [T], &'a mut [T]);

const N_FUNCTIONS: usize = 10;

/// Whether any number is below a bound.
struct AnyBelow<'a, T>(&'a [T], f64);

impl<T: Element> LaneKernel<T> for AnyBelow<'_, T> {
    type Output = bool;
    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) -> bool {
        // Missing entries are zero, which is below no bound of the test.
        let any = |x: &[T]| L::any(L::load(x).less(L::splat(self.1)));
        self.0.chunks(L::COUNT).any(any)
    }
}

impl<T: Element> LaneKernel<T> for Functions<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) {
        let n = self.0.len();
        let mut i = 0;
        while i < n {
            let x = L::load(&self.0[i..]);
            let results: [L; N_FUNCTIONS] = [
                x.ln(),
                x.ln_1p(),
                (x - L::splat(3.0)).floor(),
                x.sqrt(),
                x.powf(2.5),
                x.mul_add(x, -x) / (x + L::one()),
                x.min(L::splat(2.0)).max(L::splat(0.5)),
                x.powf(-3.0),
                (-x).ln().abs(),
                (x - L::splat(1.0)).atan(),
            ];
            for (k, r) in results.into_iter().enumerate() {
                r.store(&mut self.1[k * n + i..(k + 1) * n]);
            }
            i += L::COUNT;
        }
    }
}

fn run<T: Element>(level: SimdLevel, x: &[T]) -> Vec<T> {
    let mut out = vec![T::default(); N_FUNCTIONS * x.len()];
    T::dispatch(level, Functions(x, &mut out));
    out
}

proptest! {
    #[test]
    fn wide_lanes_give_the_scalar_bits(x in prop::collection::vec(1e-30f64..50.0, 1..40)) {
        let scalar = run(SimdLevel::Scalar, &x);
        for level in [SimdLevel::Wide256, SimdLevel::Widest] {
            for (a, b) in scalar.iter().zip(run(level, &x)) {
                prop_assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()), "{a} {b}");
            }
        }
        let x: Vec<f32> = x.iter().map(|&x| x as f32).collect();
        let scalar = run(SimdLevel::Scalar, &x);
        for level in [SimdLevel::Wide256, SimdLevel::Widest] {
            for (a, b) in scalar.iter().zip(run(level, &x)) {
                prop_assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()), "{a} {b}");
            }
        }
    }

    /// Two units in the last place: one rounding each in the series and in `e ln 2`. The rounding of `1 + x`
    /// is a third one: half a unit of numbers from 1 to 2, which is one of `ln sqrt 2`.
    #[test]
    fn logarithm_is_accurate(e in -60.0f64..60.0) {
        let x = e.exp();
        prop_assert!((Lane::ln(x) - x.ln()).abs() <= 2.0 * f64::EPSILON * x.ln().abs());
        let small = if e > 0.0 { (-e).exp() } else { -0.9 * e.exp() };
        prop_assert!((Lane::ln_1p(small) - small.ln_1p()).abs() <= 3.0 * f64::EPSILON * small.ln_1p().abs());
    }

    /// Four units in the last place: roundings in the reduction, in two polynomials and in the sum.
    #[test]
    fn arc_tangent_is_accurate(e in -30.0f64..30.0, negative: bool) {
        let x = if negative { -e.exp() } else { e.exp() };
        prop_assert!((Lane::atan(x) - x.atan()).abs() <= 4.0 * f64::EPSILON * x.atan().abs());
        let single = x as f32;
        let exact = f64::from(single).atan();
        let error = (f64::from(Lane::atan(single)) - exact).abs();
        prop_assert!(error <= 4.0 * f64::from(f32::EPSILON) * exact.abs());
    }
}

#[test]
fn arc_tangent_at_the_ends() {
    assert_eq!(Lane::atan(0.0f64), 0.0);
    assert_eq!(Lane::atan(f64::INFINITY), std::f64::consts::FRAC_PI_2);
    assert_eq!(Lane::atan(f64::NEG_INFINITY), -std::f64::consts::FRAC_PI_2);
    assert!(Lane::atan(f64::NAN).is_nan());
}

/// Copies through registers.
struct Copied<'a, T>(&'a [T], &'a mut [T]);

impl<T: Element> LaneKernel<T> for Copied<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) {
        let Self(source, target) = self;
        for start in (0..source.len()).step_by(L::COUNT) {
            L::load(&source[start..]).store(&mut target[start..]);
        }
    }
}

/// Each slice is an allocation of its own: the address sanitizer sees what is beyond its end.
#[test]
fn loads_and_stores_end_with_the_slice() {
    for len in 1..=2 * fe_grid::MAX_LANES + 1 {
        let source: Box<[f64]> = (0..len).map(|i| i as f64).collect();
        let single: Box<[f32]> = source.iter().map(|x| *x as f32).collect();
        for level in [SimdLevel::Scalar, SimdLevel::Wide256, SimdLevel::Widest] {
            let mut target = vec![f64::NAN; len].into_boxed_slice();
            f64::dispatch(level, Copied(&source, &mut target));
            assert_eq!(source, target);
            let mut target = vec![f32::NAN; len].into_boxed_slice();
            f32::dispatch(level, Copied(&single, &mut target));
            assert_eq!(single, target);
        }
    }
}

#[test]
fn any_finds_a_single_entry() {
    for level in [SimdLevel::Scalar, SimdLevel::Wide256, SimdLevel::Widest] {
        for place in 0..40 {
            let mut x = [1.0f64; 40];
            x[place] = -1.0;
            assert!(f64::dispatch(level, AnyBelow(&x, -0.5)));
            assert!(!f64::dispatch(level, AnyBelow(&x, -1.0)));
            let x = x.map(|x| x as f32);
            assert!(f32::dispatch(level, AnyBelow(&x, -0.5)));
            assert!(!f32::dispatch(level, AnyBelow(&x, -1.0)));
        }
    }
}

#[test]
fn logarithm_outside_its_domain_is_nan() {
    assert!(Lane::ln(-1.0f64).is_nan());
    assert!(Lane::ln(0.0f64).is_nan());
    assert!(Lane::ln_1p(-2.0f32).is_nan());
}
