//! Values, stresses and tangents against reference values made by automatic differentiation.

use crate::common::law::Law;
use crate::common::{Matrix, distance, minus_identity, norm};
use fe_grid::tensor;
use hyperelastic::{
    Inverse, LameModuli, LogDet, LogDetBarrier, Power, PowerCoefficients, PowerExponents,
    SeedLiteral, SeedParameters,
};
use serde_json::Value;
use std::collections::BTreeMap;
use test_support::{number, oracle};

/// What the reference file grants.
const RELATIVE: f64 = 1e-10;
/// For values that are nearly zero.
const ABSOLUTE: f64 = 1e-12;

fn matrix<const D: usize>(rows: &Value) -> Matrix<D> {
    let mut a = tensor::zero::<f64, D>();
    for i in 0..D {
        for k in 0..D {
            a[i][k] = rows[i][k].as_f64().unwrap();
        }
    }
    a
}

fn power<const D: usize>(params: &Value) -> Power<D> {
    Power::from_coefficients(
        PowerCoefficients {
            norm: number(params, "a1"),
            cofactor: number(params, "a2"),
            compression: number(params, "a3"),
        },
        PowerExponents {
            norm: number(params, "p"),
            cofactor: number(params, "q"),
            expansion: number(params, "r"),
            compression: number(params, "s"),
        },
    )
    .unwrap()
}

fn moduli(params: &Value) -> LameModuli {
    crate::common::moduli(number(params, "lambda"), number(params, "mu"))
}

fn seed<const D: usize>(params: &Value) -> SeedLiteral<D> {
    SeedLiteral::new(SeedParameters {
        norm: number(params, "a1"),
        cofactor: number(params, "a2"),
        volume: number(params, "a3"),
        half_norm_exponent: params["p"].as_u64().unwrap() as u32 / 2,
        half_cofactor_exponent: params["q"].as_u64().unwrap() as u32 / 2,
        expansion: number(params, "r"),
        compression: number(params, "s"),
    })
    .unwrap()
}

fn close(what: &str, found: f64, expected: f64) {
    let error = (found - expected).abs();
    assert!(
        error <= RELATIVE * expected.abs() + ABSOLUTE,
        "{what}: {found} instead of {expected}"
    );
}

fn compare<const D: usize>(law: &dyn Law<D>, case: &Value) {
    let h = minus_identity(&matrix::<D>(&case["A"]));
    let b = matrix::<D>(&case["B"]);
    let (value, stress) = law.gradient(&h);
    close("W", value, number(case, "W"));
    close("W", law.value(&h), number(case, "W"));
    let expected = matrix::<D>(&case["W_A"]);
    assert!(
        distance(&stress, &expected) <= RELATIVE * norm(&expected) + ABSOLUTE,
        "{law:?}: W_A"
    );
    let action = law.hessian_action(&h, &b);
    let expected = matrix::<D>(&case["W_AA_B"]);
    assert!(
        distance(&action, &expected) <= RELATIVE * norm(&expected) + ABSOLUTE,
        "{law:?}: W_AA_B"
    );
    close(
        "W_AA_BB",
        tensor::contract(&action, &b),
        number(case, "W_AA_BB"),
    );
    if case["derived"].is_object() {
        let LameModuli { lambda, mu } = law.moduli();
        close("lambda", lambda, number(&case["derived"], "lambda_"));
        close("mu", mu, number(&case["derived"], "mu"));
    }
}

fn check_case<const D: usize>(case: &Value) {
    let (name, params) = (
        case["model"]["name"].as_str().unwrap(),
        &case["model"]["params"],
    );
    match name {
        "logdet" => compare(&LogDet::<D>::new(moduli(params)).unwrap(), case),
        "logdet_barrier" => {
            let (b, p) = (number(params, "b"), number(params, "p"));
            compare(
                &LogDetBarrier::<D>::with_barrier(moduli(params), b, p).unwrap(),
                case,
            );
        }
        "power" => {
            let law = power::<D>(params);
            let beta = law.expansion_coefficient() / law.compression_coefficient();
            close("beta", beta, number(&case["derived"], "beta"));
            compare(&law, case);
        }
        "seed_literal" => compare(&seed::<D>(params), case),
        "inverse" => {
            let base = &params["base"];
            match base["name"].as_str().unwrap() {
                "logdet" => {
                    let law = LogDet::<D>::new(moduli(&base["params"])).unwrap();
                    compare(&Inverse::new(law), case);
                }
                "power" => compare(&Inverse::new(power::<D>(&base["params"])), case),
                other => panic!("no base law {other}"),
            }
        }
        other => panic!("no law {other}"),
    }
}

#[test]
fn oracle_densities() {
    let Some(file) = oracle("densities.json") else {
        return;
    };
    let mut counts = BTreeMap::new();
    for case in file["cases"].as_array().unwrap() {
        let dimension = case["dim"].as_u64().unwrap();
        match dimension {
            2 => check_case::<2>(case),
            3 => check_case::<3>(case),
            other => panic!("no dimension {other}"),
        }
        let name = case["model"]["name"].as_str().unwrap().to_owned();
        *counts.entry((name, dimension)).or_insert(0) += 1;
    }
    // Five kinds of law in two dimensions, none of them left out.
    assert_eq!(counts.len(), 10, "{counts:?}");
    println!("{counts:?}");
}
