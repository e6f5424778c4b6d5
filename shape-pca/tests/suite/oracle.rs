//! Loads and the compound operator against reference values that were made by automatic
//! differentiation.
//!
//! The reference stores deformed positions `Phi`; here unknowns are displacements
//! `u = Phi - id`, by which the derivatives are the same.

use fe_grid::pullback::Derivatives;
use fe_grid::vector::dot;
use fe_grid::vector::{max_abs, max_abs_difference};
use fe_grid::{Field, Grid, LinearOperator};
use hyperelastic::{LameModuli, LawSpec};
use serde_json::Value;
use shape_pca::{Source, evaluate};
use test_support::{flat, oracle};

/// What the reference files grant, in the maximum norm of each array.
const RELATIVE: f64 = 1e-10;

#[track_caller]
fn close(what: &str, found: &[f64], expected: &Value) {
    let expected = flat(expected);
    let error = max_abs_difference(found, &expected) / max_abs(&expected);
    assert!(error <= RELATIVE, "{what}: relative error {error:e}");
}

fn check_file<const D: usize>(name: &str) {
    let Some(file) = oracle(name) else { return };
    let grid = Grid::<D>::cube(file["n"].as_u64().unwrap() as usize);
    let cases = file["cases"].as_array().unwrap();
    let mut checked = 0;
    for case in cases.iter().filter(|case| case["kind"] == "pca_operators") {
        assert_eq!(case["model"]["name"], "logdet");
        let number = |value: &Value| value.as_f64().expect("a number");
        let params = &case["model"]["params"];
        let moduli = LameModuli::new(number(&params["lambda"]), number(&params["mu"])).unwrap();
        let law = LawSpec::new("logdet", moduli).unwrap();
        let inputs = &case["inputs"];
        let mut displacement = flat(&inputs["phi"]);
        let identity = Field::<f64, D, D>::identity(grid);
        for (u, x) in displacement.iter_mut().zip(identity.as_slice()) {
            *u -= x;
        }
        let source = Source {
            weight: 1.0,
            displacement: &displacement,
            indicator: &flat(&inputs["chi"]),
        };
        let delta = number(&inputs["delta"]);
        let all = Derivatives::Hessian;
        let found = evaluate(&grid, &law.compile().unwrap(), delta, &[source], &[], all).unwrap();
        close("load", &found.gradient, &case["load"]);
        let (matrix, _) = found.hessian.expect("it was asked for");
        let u = flat(&inputs["u"]);
        let mut product = vec![0.0; u.len()];
        matrix.apply_into(&u, &mut product);
        close("K u", &product, &case["K_u"]);
        close("u.K u", &[dot(&u, &product)], &case["energy_uu"]);
        checked += 1;
    }
    assert_eq!(checked, 1);
}

#[test]
fn oracle_operators_in_2d() {
    check_file::<2>("grid2d_n5.json");
}

#[test]
fn oracle_operators_in_3d() {
    check_file::<3>("grid3d_n5.json");
}
