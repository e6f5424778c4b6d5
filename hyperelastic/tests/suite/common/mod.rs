//! Matrices, random deformations and laws shared by the tests.

pub mod law;

use fe_grid::{Tensor, tensor};
use hyperelastic::{
    Inverse, LameModuli, LinearElasticity, LogDet, LogDetBarrier, Power, PowerCoefficients,
    PowerExponents,
};
use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;

pub type Matrix<const D: usize> = Tensor<f64, D>;

/// Half the usual number of cases (`PROPTEST_CASES` raises it), since many laws go through each;
/// failures are kept in a file of the crate.
pub fn config(failures: &'static str) -> ProptestConfig {
    let usual = ProptestConfig::default();
    ProptestConfig {
        cases: usual.cases / 2,
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(failures))),
        ..usual
    }
}

pub fn moduli(lambda: f64, mu: f64) -> LameModuli {
    LameModuli::new(lambda, mu).unwrap()
}

pub fn norm<const D: usize>(a: &Matrix<D>) -> f64 {
    tensor::contract(a, a).sqrt()
}

/// `|a - b|`.
pub fn distance<const D: usize>(a: &Matrix<D>, b: &Matrix<D>) -> f64 {
    norm(&tensor::sub(a, b))
}

/// `a - 1`.
pub fn minus_identity<const D: usize>(a: &Matrix<D>) -> Matrix<D> {
    tensor::sub(a, &tensor::diagonal(1.0))
}

pub fn diagonal<const D: usize>(entries: &[f64]) -> Matrix<D> {
    let mut a = tensor::zero::<f64, D>();
    for i in 0..D {
        a[i][i] = entries[i];
    }
    a
}

/// Rotation by an angle in the plane of axes `i` and `k`.
pub fn plane_rotation<const D: usize>(i: usize, k: usize, angle: f64) -> Matrix<D> {
    let mut q = tensor::diagonal::<f64, D>(1.0);
    q[i][i] = angle.cos();
    q[k][k] = angle.cos();
    q[i][k] = -angle.sin();
    q[k][i] = angle.sin();
    q
}

/// Any rotation: one angle in 2D, three in 3D.
pub fn rotation<const D: usize>(angles: [f64; 3]) -> Matrix<D> {
    let q = plane_rotation::<D>(0, 1, angles[0]);
    if D == 2 {
        return q;
    }
    let q = tensor::product(&q, &plane_rotation::<D>(1, 2, angles[1]));
    tensor::product(&q, &plane_rotation::<D>(0, 2, angles[2]))
}

pub fn angles() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-3.2f64..3.2)
}

pub fn any_rotation<const D: usize>() -> impl Strategy<Value = Matrix<D>> {
    angles().prop_map(rotation::<D>)
}

/// Singular values, and the matrix `Q diag(stretches) R` that has them.
pub fn stretched<const D: usize>(
    low: f64,
    high: f64,
) -> impl Strategy<Value = ([f64; 3], Matrix<D>)> {
    (prop::array::uniform3(low..high), angles(), angles()).prop_map(|(stretches, q, r)| {
        let middle = tensor::product(&rotation::<D>(q), &diagonal::<D>(&stretches));
        (stretches, tensor::product(&middle, &rotation::<D>(r)))
    })
}

/// Displacement gradients with all stretches between .4 and 2.2.
pub fn admissible<const D: usize>() -> impl Strategy<Value = Matrix<D>> {
    stretched::<D>(0.4, 2.2).prop_map(|(_, a)| minus_identity(&a))
}

/// Displacement gradients with all stretches between .7 and 1.5.
pub fn moderate<const D: usize>() -> impl Strategy<Value = Matrix<D>> {
    stretched::<D>(0.7, 1.5).prop_map(|(_, a)| minus_identity(&a))
}

/// Matrices with entries in [-1, 1].
pub fn direction<const D: usize>() -> impl Strategy<Value = Matrix<D>> {
    prop::array::uniform9(-1.0f64..1.0).prop_map(|entries| {
        let mut b = tensor::zero::<f64, D>();
        for i in 0..D {
            for k in 0..D {
                b[i][k] = entries[D * i + k];
            }
        }
        b
    })
}

/// The matrices with a single entry one.
pub fn units<const D: usize>() -> Vec<Matrix<D>> {
    let mut all = Vec::new();
    for i in 0..D {
        for k in 0..D {
            let mut e = tensor::zero::<f64, D>();
            e[i][k] = 1.0;
            all.push(e);
        }
    }
    all
}

pub fn logdet<const D: usize>() -> LogDet<D> {
    LogDet::new(moduli(1.0, 1.0)).unwrap()
}

pub fn logdet_stiff<const D: usize>() -> LogDet<D> {
    LogDet::new(moduli(100.0, 1.0)).unwrap()
}

pub fn logdet_barrier<const D: usize>() -> LogDetBarrier<D> {
    LogDetBarrier::new(moduli(2.5, 0.7)).unwrap()
}

/// Exponents that are neither integers nor halves.
pub fn logdet_barrier_odd<const D: usize>() -> LogDetBarrier<D> {
    LogDetBarrier::with_barrier(moduli(2.5, 0.7), 0.2, 2.3).unwrap()
}

pub fn power<const D: usize>() -> Power<D> {
    Power::new(moduli(1.0, 1.0)).unwrap()
}

pub fn power_soft<const D: usize>() -> Power<D> {
    Power::new(moduli(0.01, 1.0)).unwrap()
}

pub fn power_two_term<const D: usize>() -> Power<D> {
    let exponents = PowerExponents {
        norm: 4.0,
        cofactor: 4.0,
        expansion: 2.0,
        compression: 1.0,
    };
    Power::two_term(moduli(8.0, 1.0), exponents, Some(0.5)).unwrap()
}

/// Exponents that are neither integers nor halves of them.
pub fn power_odd<const D: usize>() -> Power<D> {
    let coefficients = PowerCoefficients {
        norm: 0.3,
        cofactor: 0.2,
        compression: 8.0,
    };
    let exponents = PowerExponents {
        norm: 3.5,
        cofactor: 4.7,
        expansion: 1.5,
        compression: 2.2,
    };
    Power::from_coefficients(coefficients, exponents).unwrap()
}

pub fn inverse_logdet<const D: usize>() -> Inverse<LogDet<D>> {
    Inverse::new(logdet())
}

pub fn inverse_power<const D: usize>() -> Inverse<Power<D>> {
    Inverse::new(power())
}

pub fn linear<const D: usize>() -> LinearElasticity<D> {
    LinearElasticity::new(moduli(1.3, 0.8)).unwrap()
}
