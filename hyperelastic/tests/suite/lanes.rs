//! Wide registers give, bit for bit, what one number at a time gives.

use crate::common::{Matrix, stretched};
use fe_grid::{Element, Lane, LaneKernel, SimdLevel, Tensor, tensor};
use hyperelastic::{CompiledLaw, Inverse, LawName, LogDet, Power};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

/// Applies a law to states stored component by component.
struct Apply<'a, T, const D: usize> {
    law: &'a CompiledLaw<D>,
    states: &'a [Tensor<T, D>],
}

fn gather<L: Lane, const D: usize>(states: &[Tensor<L::Element, D>]) -> Tensor<L, D> {
    let mut h = tensor::zero::<L, D>();
    for i in 0..D {
        for k in 0..D {
            let column: Vec<_> = states.iter().map(|state| state[i][k]).collect();
            h[i][k] = L::load(&column);
        }
    }
    h
}

impl<T: Element, const D: usize> LaneKernel<T> for Apply<'_, T, D> {
    type Output = Vec<T>;
    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) -> Vec<T> {
        let n = self.states.len();
        let n_numbers = 1 + 2 * D * D;
        let mut out = vec![T::default(); n_numbers * n];
        let mut start = 0;
        while start < n {
            let h = gather::<L, D>(&self.states[start..n.min(start + L::COUNT)]);
            let (value, stress) = self.law.gradient(&h);
            let action = self.law.hessian_action(&h, &stress);
            let end = n.min(start + L::COUNT);
            value.store(&mut out[start..end]);
            for i in 0..D {
                for k in 0..D {
                    let place = (1 + D * i + k) * n;
                    stress[i][k].store(&mut out[place + start..place + end]);
                    let place = place + D * D * n;
                    action[i][k].store(&mut out[place + start..place + end]);
                }
            }
            start += L::COUNT;
        }
        out
    }
}

/// How many numbers are finite, which are the same on all instruction sets.
fn finite<T: Element, const D: usize>(law: &CompiledLaw<D>, states: &[Tensor<T, D>]) -> usize {
    let at = |level: SimdLevel| T::dispatch(level, Apply { law, states });
    let bits = |numbers: Vec<T>| -> Vec<u64> {
        // One NaN is as good as another.
        let bits = |x: T| match x.to_f64() {
            x if x.is_nan() => u64::MAX,
            x => x.to_bits(),
        };
        numbers.into_iter().map(bits).collect()
    };
    let scalar = bits(at(SimdLevel::Scalar));
    for level in [SimdLevel::Wide256, SimdLevel::Widest] {
        assert!(bits(at(level)) == scalar, "{} at {level:?}", law.name());
    }
    scalar.into_iter().filter(|&x| x != u64::MAX).count()
}

/// 37 states, some folded: no multiple of any register's width.
fn states<const D: usize>() -> Vec<Matrix<D>> {
    let mut runner = TestRunner::deterministic();
    let mut draw = |low: f64, high: f64| {
        let tree = stretched::<D>(low, high).new_tree(&mut runner).unwrap();
        crate::common::minus_identity(&tree.current().1)
    };
    let mut states: Vec<_> = (0..35).map(|_| draw(0.3, 2.0)).collect();
    states.extend([draw(-1.5, -0.5), tensor::diagonal(-1.0)]);
    states
}

/// How many numbers a law has at all states, at least.
fn least<const D: usize>() -> usize {
    35 * (1 + 2 * D * D)
}

fn check<const D: usize>() {
    let states = states::<D>();
    for law in LawName::all() {
        let moduli = crate::common::moduli(20.0, 1.0);
        let law = law.with(moduli).compile::<D>().unwrap();
        let double = finite(&law, &states);
        assert!(double >= least::<D>(), "{double}");
    }
}

/// Single precision, which only [`CompiledLaw::in_both_precisions`] compiles.
fn check_single<const D: usize>() {
    let states = states::<D>();
    let narrow: Vec<Tensor<f32, D>> = states
        .iter()
        .map(|a| a.map(|row| row.map(|x| x as f32)))
        .collect();
    let moduli = crate::common::moduli(20.0, 1.0);
    let logdet = LogDet::<D>::new(moduli).unwrap();
    for law in [
        CompiledLaw::in_both_precisions(logdet),
        CompiledLaw::in_both_precisions(Power::<D>::new(moduli).unwrap()),
        CompiledLaw::in_both_precisions(Inverse::new(logdet)),
    ] {
        let (double, single) = (finite(&law, &states), finite(&law, &narrow));
        assert!(single >= least::<D>(), "{single}");
        assert_eq!(double, single);
    }
}

#[test]
fn lanes_agree_bit_for_bit_in_2d() {
    check::<2>();
    check_single::<2>();
}

#[test]
fn lanes_agree_bit_for_bit_in_3d() {
    check::<3>();
    check_single::<3>();
}
