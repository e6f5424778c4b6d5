//! Every pair of moduli is reached, or the error names the bound; names and parameters go through
//! text and back.

use crate::common::{Matrix, direction, moduli};
use fe_grid::tensor;
use hyperelastic::{
    CompiledLaw, LameModuli, LawError, LawName, LawSpec, LogDet, LogDetBarrier, Power,
    PowerCoefficients, PowerExponents, PowerOptions, StoredEnergy, ViscousDissipation,
};
use proptest::prelude::*;

/// `|W_,AA(1)[B] - (lambda tr e 1 + 2 mu e)|` over the larger modulus.
fn inconsistency<const D: usize>(spec: &LawSpec, b: &Matrix<D>) -> f64 {
    let moduli = spec.moduli;
    let action = spec.compile().unwrap().hessian_action(&tensor::zero(), b);
    let viscous = ViscousDissipation { moduli };
    crate::common::distance(&action, &viscous.stress(b)) / (moduli.lambda + moduli.mu)
}

/// The laws that promise to reach all moduli.
const ALL_MODULI: [&str; 7] = [
    "logdet",
    "logdet_barrier",
    "power",
    "linear",
    "inverse:logdet",
    "inverse:logdet_barrier",
    "inverse:power",
];

fn reaches<const D: usize>(ratio: f64, mu: f64, b: &Matrix<D>) {
    let moduli = moduli(ratio * mu, mu);
    for name in ALL_MODULI {
        let spec = LawSpec::new(name, moduli).unwrap();
        let error = inconsistency(&spec, b);
        // Rounding of the constants, with |b| < 3.
        assert!(error < 1e-12, "{name} in {D}D at {ratio}: {error}");
    }
}

proptest! {
    #![proptest_config(crate::common::config("proptest-regressions/constructors.txt"))]
    #[test]
    fn every_ratio_of_moduli_is_reached(
        exponent in -2.0f64..2.0,
        shear in 0.1f64..10.0,
        b2 in direction::<2>(),
        b3 in direction::<3>(),
    ) {
        for ratio in [0.01, 100.0, 10f64.powf(exponent)] {
            reaches(ratio, shear, &b2);
            reaches(ratio, shear, &b3);
        }
    }
}

#[test]
fn laws_know_their_names() {
    // Large enough for the two-term law.
    let moduli = moduli(20.0, 1.0);
    assert_eq!(LawName::all().count(), 9);
    for name in LawName::all() {
        let text = name.to_string();
        assert_eq!(text.parse(), Ok(name));
        let spec = name.with(moduli);
        assert_eq!(spec.compile::<2>().unwrap().name(), text);
        assert_eq!(spec.compile::<3>().unwrap().name(), text);
        let json = serde_json::to_string(&spec).unwrap();
        assert_eq!(serde_json::from_str::<LawSpec>(&json).unwrap(), spec);
    }
    assert_eq!(LawSpec::default().law.to_string(), "logdet");
}

#[test]
fn unknown_names_and_keys_are_refused() {
    let error = LawSpec::new("log_det", LameModuli::default()).unwrap_err();
    assert!(matches!(&error, LawError::UnknownLaw { name, .. } if name == "log_det"));
    assert!(error.to_string().contains("inverse:logdet"), "{error}");
    for name in ["inverse:linear", "inverse:inverse:logdet", "", "LogDet"] {
        assert!(LawSpec::new(name, LameModuli::default()).is_err(), "{name}");
    }
    let extra = r#"{"law":"logdet","lambda":1,"mu":1,"lamda":2}"#;
    assert!(serde_json::from_str::<LawSpec>(extra).is_err());
    let unknown = r#"{"law":"rubber","lambda":1,"mu":1}"#;
    assert!(serde_json::from_str::<LawSpec>(unknown).is_err());
}

#[test]
fn unusable_moduli_are_refused() {
    for (lambda, mu) in [
        (-1.0, 1.0),
        (1.0, 0.0),
        (1.0, -1.0),
        (f64::NAN, 1.0),
        (1.0, f64::NAN),
        (f64::INFINITY, 1.0),
        (1.0, f64::INFINITY),
    ] {
        assert!(LameModuli::new(lambda, mu).is_err());
        let unchecked = LameModuli { lambda, mu };
        for law in LawName::all() {
            let spec = law.with(unchecked);
            let error = spec.compile::<3>().unwrap_err();
            assert!(matches!(error, LawError::Moduli { .. }), "{error}");
        }
    }
}

#[test]
fn parameters_out_of_range_are_refused() {
    let moduli = moduli(1.0, 1.0);
    for (weight, exponent) in [(-0.1, 2.0), (0.3, 2.0), (0.1, 0.5), (f64::NAN, 2.0)] {
        assert!(LogDetBarrier::<2>::with_barrier(moduli, weight, exponent).is_err());
    }
    let with = |change: fn(&mut PowerExponents)| {
        let mut exponents = PowerExponents::default();
        change(&mut exponents);
        Power::<3>::null_lagrangian(moduli, exponents, None)
    };
    assert!(with(|_| ()).is_ok());
    assert!(with(|e| e.norm = 2.5).is_err());
    assert!(with(|e| e.cofactor = 1.0).is_err());
    assert!(with(|e| e.expansion = 1.0).is_err());
    assert!(with(|e| e.compression = 0.0).is_err());
    assert!(with(|e| e.compression = f64::NAN).is_err());
    assert!(with(|e| e.norm = f64::INFINITY).is_err());
    for share in [-0.1, 1.1, f64::NAN] {
        assert!(
            Power::<3>::null_lagrangian(moduli, PowerExponents::default(), Some(share)).is_err()
        );
    }
    let none = PowerCoefficients {
        norm: 0.0,
        cofactor: 0.0,
        compression: 1.0,
    };
    assert!(Power::<2>::from_coefficients(none, PowerExponents::default()).is_err());
}

/// In 3D with `p = q = 4`, a share of one half fails at `lambda = mu` and one always works.
#[test]
fn the_share_of_the_cofactor_is_bounded_in_3d() {
    let make = |lambda: f64, share: Option<f64>| {
        Power::<3>::null_lagrangian(moduli(lambda, 1.0), PowerExponents::default(), share)
    };
    // Gamma''(1) = lambda - P (p-5)/3 - 4 Q (q-2)/3 = lambda + t/3 - 8 (1-t)/3.
    let error = make(1.0, Some(0.5)).unwrap_err();
    let LawError::LambdaBelowBound {
        bound, norm_share, ..
    } = error
    else {
        panic!("{error}");
    };
    assert_eq!(norm_share, 0.5);
    assert!((bound - 7.0 / 6.0).abs() < 1e-15, "{bound}");
    assert!(make(7.0 / 6.0 + 1e-9, Some(0.5)).is_ok());
    assert!(make(7.0 / 6.0 - 1e-9, Some(0.5)).is_err());
    for lambda in [1e-6, 0.01, 1.0, 100.0] {
        assert!(make(lambda, Some(1.0)).is_ok());
        let free = make(lambda, None).unwrap();
        assert!(free.compression_coefficient() > 0.0);
        assert!(free.expansion_coefficient() > 0.0);
    }
}

/// The two-term form reaches its bound, where `beta` vanishes, and names it below.
#[test]
fn the_two_term_form_names_its_bound() {
    let exponents = PowerExponents {
        norm: 4.0,
        cofactor: 4.0,
        expansion: 2.0,
        compression: 3.0,
    };
    let make = |lambda: f64| Power::<3>::two_term(moduli(lambda, 1.0), exponents, Some(0.5));
    // P = Q = 1/2: P 2/3 + 2 Q + Q 8/3 + s (P + 2 Q) = 1/3 + 1 + 4/3 + 9/2.
    let expected = 1.0 / 3.0 + 1.0 + 4.0 / 3.0 + 4.5;
    match make(1.0) {
        Err(LawError::LambdaBelowBound { bound, .. }) => {
            assert!((bound - expected).abs() < 1e-14);
        }
        other => panic!("{other:?}"),
    }
    let at_bound = make(expected * (1.0 + 1e-15)).unwrap();
    assert!(at_bound.expansion_coefficient().abs() < 1e-13);
    assert!(at_bound.hypotheses().polyconvex);
    let above = make(20.0).unwrap();
    assert!((above.moduli().lambda - 20.0).abs() < 1e-12);
    assert!((above.moduli().mu - 1.0).abs() < 1e-14);
    assert!(above.expansion_coefficient() > 0.0);
    // Without a share, the middle of those that are possible at lambda = 4: the bound is
    // 2/3 + 3 at t = 1 and 2 + 8/3 + 6 at t = 0.
    let free = Power::<3>::two_term(moduli(4.0, 1.0), exponents, None).unwrap();
    assert!((free.moduli().lambda - 4.0).abs() < 1e-12);
    assert!(free.expansion_coefficient() > 0.0);
    match Power::<3>::two_term(moduli(1.0, 1.0), exponents, None) {
        Err(LawError::LambdaBelowBound { bound, .. }) => {
            assert!((bound - 11.0 / 3.0).abs() < 1e-14);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_barrier_leaves_the_moduli() {
    for lambda in [0.0, 1.0] {
        let law = LogDetBarrier::<3>::new(moduli(lambda, 2.0)).unwrap();
        assert_eq!(law.moduli(), moduli(lambda, 2.0));
    }
    // Without weight it is the law without barrier.
    let bare = LogDetBarrier::<2>::with_barrier(moduli(1.0, 1.0), 0.0, 2.0).unwrap();
    let plain = LogDet::<2>::new(moduli(1.0, 1.0)).unwrap();
    let h = [[0.1, -0.3], [0.2, 0.4]];
    assert_eq!(bare.gradient(&h), plain.gradient(&h));
}

/// `power_two_term` with these options.
fn two_term(power: PowerOptions) -> LawSpec {
    LawSpec {
        power,
        ..LawSpec::new("power_two_term", LameModuli::default()).unwrap()
    }
}

/// `W(1 + H)` at some gradients.
fn values<const D: usize>(law: &CompiledLaw<D>) -> Vec<f64> {
    let gradient =
        |s: f64| std::array::from_fn(|i| std::array::from_fn(|k| s * (i + 2 * k) as f64));
    [-0.04, 0.01, 0.07]
        .map(|s| law.value(&gradient(s)))
        .to_vec()
}

/// Coefficients state a law whose moduli are those of its response; the same law is stated by these moduli
/// and the share of the first term, `P = a1 p d^(p/2-1)` of `mu = P + Q`.
fn coefficients_state_a_law<const D: usize>() {
    let [p, q, r, s] = [4.0, 3.0, 2.0, 2.5];
    let [a1, a2, a3] = [0.1, 0.07, 0.9];
    let by_coefficients = two_term(PowerOptions {
        exponents: Some([p, q, r, s].into()),
        coefficients: Some([a1, a2, a3].into()),
        norm_share: None,
    });
    let resolved = by_coefficients.resolved::<D>().unwrap();
    let law = resolved.compile::<D>().unwrap();
    let d = D as f64;
    let (of_norm, of_cofactor) = (
        a1 * p * d.powf(0.5 * p - 1.0),
        a2 * q * d.powf(0.5 * q - 1.0),
    );
    let relative = |a: f64, b: f64| (a - b).abs() / b.abs();
    assert!(relative(resolved.moduli.mu, of_norm + of_cofactor) < 1e-12);
    assert!(relative(law.moduli().lambda, resolved.moduli.lambda) < 1e-12);
    let by_moduli = LawSpec {
        power: PowerOptions {
            coefficients: None,
            norm_share: Some(of_norm / resolved.moduli.mu),
            ..resolved.power
        },
        ..resolved
    };
    let same = by_moduli.compile::<D>().unwrap();
    for (a, b) in values(&law).into_iter().zip(values(&same)) {
        // Energies of strains of some percent are differences of terms a thousand times as large.
        assert!(relative(a, b) < 1e-9, "{a} {b}");
    }
    // Moduli of another law are not overlooked.
    let error = by_coefficients.compile::<D>().unwrap_err();
    assert!(matches!(error, LawError::ModuliDiffer { .. }), "{error}");
}

#[test]
fn coefficients_of_a_power_law_are_options() {
    coefficients_state_a_law::<2>();
    coefficients_state_a_law::<3>();
}

#[test]
fn options_of_other_laws_are_refused() {
    let exponents = PowerOptions {
        exponents: Some([4.0, 4.0, 2.0, 9.0].into()),
        ..PowerOptions::default()
    };
    let coefficients = PowerOptions {
        coefficients: Some([0.1, 0.1, 0.2].into()),
        ..PowerOptions::default()
    };
    let with = |law: &str, power| LawSpec {
        power,
        ..LawSpec::new(law, LameModuli::default()).unwrap()
    };
    for (law, power) in [
        ("logdet", exponents),
        ("inverse:logdet_barrier", exponents),
        ("linear", coefficients),
        ("power", coefficients),
    ] {
        let spec = with(law, power);
        let error = spec.compile::<2>().unwrap_err();
        assert!(matches!(error, LawError::Option { .. }), "{law}: {error}");
    }
    assert!(with("power", exponents).compile::<3>().is_ok());
    let both = two_term(PowerOptions {
        norm_share: Some(0.5),
        ..coefficients
    });
    let error = both.resolved::<2>().unwrap_err();
    assert!(matches!(error, LawError::Parameter { .. }), "{error}");
    for text in ["", "1,2", "1,2,3,x", "1,2,3,4,5"] {
        assert!(text.parse::<PowerExponents>().is_err(), "{text}");
    }
    assert_eq!("4, 4,2,9".parse(), Ok(PowerExponents::default()));
}
