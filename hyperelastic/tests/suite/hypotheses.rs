//! The growth that the laws report is the growth that they have, and the theorems that apply.

use crate::common::{diagonal, minus_identity};
use fe_grid::tensor;
use hyperelastic::{
    Hypotheses, Inverse, LameModuli, LawName, LawSpec, LogDet, LogDetBarrier, Power,
    PowerExponents, StoredEnergy,
};
use proptest::prelude::*;

/// Logarithm of `|A|^p + |cof A|^q + D^r + D^-s` with the exponents reported.
fn reported(hypotheses: &Hypotheses, norm: f64, cofactor: f64, determinant: f64) -> f64 {
    let growth = hypotheses.growth;
    [
        growth.norm * norm.ln(),
        growth.cofactor * cofactor.ln(),
        growth.expansion * determinant.ln(),
        -growth.compression * determinant.ln(),
        0.0,
    ]
    .into_iter()
    .fold(f64::NEG_INFINITY, f64::max)
}

/// Rates of growth, of the law and as reported, between two points of the path
/// `A(t) = diag(t^u)`; rotations change neither.
fn rates<const D: usize>(spec: &LawSpec, powers: [f64; 3]) -> (f64, f64) {
    let law = spec.compile::<D>().unwrap();
    let hypotheses = law.hypotheses();
    let at = |t: f64| {
        let stretches = powers.map(|u| t.powf(u));
        let a = diagonal::<D>(&stretches);
        let norm = crate::common::norm(&a);
        let cofactor = crate::common::norm(&tensor::cofactor(&a));
        let determinant: f64 = stretches[..D].iter().product();
        (
            law.value(&minus_identity(&a)).ln(),
            reported(&hypotheses, norm, cofactor, determinant),
        )
    };
    // Far out, so that powers have left logarithms and constants behind.
    let (t0, t1): (f64, f64) = (1e8, 1e14);
    let ((w0, g0), (w1, g1)) = (at(t0), at(t1));
    let span = (t1 / t0).ln();
    ((w1 - w0) / span, (g1 - g0) / span)
}

proptest! {
    #![proptest_config(crate::common::config("proptest-regressions/hypotheses.txt"))]
    /// Along every power-law path the energy grows at least as fast as the law says.
    #[test]
    fn growth_is_as_reported(powers in prop::array::uniform3(-0.6f64..0.6)) {
        fn check<const D: usize>(law: LawName, powers: [f64; 3]) {
            let moduli = LameModuli { lambda: 20.0, mu: 1.0 };
            let spec = law.with(moduli);
            let (found, reported) = rates::<D>(&spec, powers);
            // Terms of equal size put the rate off by ln 2 / ln 1e6, slow powers beside
            // logarithms by a little more. Exponents too large by one show as up to 0.6.
            assert!(found >= reported - 0.15, "{law} in {D}D: {found} below {reported}");
        }
        for law in LawName::all().filter(|law| law.to_string() != "linear") {
            check::<2>(law, powers);
            check::<3>(law, powers);
        }
    }
}

/// The default law is outside both theorems, and the default power law inside both.
#[test]
fn theorems_cover_what_they_cover() {
    fn check<const D: usize>() {
        let moduli = crate::common::moduli(1.0, 1.0);
        let logdet = LogDet::<D>::new(moduli).unwrap().hypotheses();
        assert!(logdet.polyconvex && logdet.barrier && logdet.minimum_on_rotations);
        assert!(!logdet.existence_theorem() && !logdet.homeomorphism_theorem());
        let barrier = LogDetBarrier::<D>::new(moduli).unwrap().hypotheses();
        assert!(!barrier.existence_theorem() && !barrier.homeomorphism_theorem());
        assert_eq!(barrier.growth.compression, 4.0);
        for ratio in [0.01, 1.0, 100.0] {
            let power = Power::<D>::new(crate::common::moduli(ratio, 1.0)).unwrap();
            let hypotheses = power.hypotheses();
            assert!(hypotheses.existence_theorem() && hypotheses.homeomorphism_theorem());
        }
    }
    check::<2>();
    check::<3>();
}

/// `s > 2 q / (q - 3)` in 3D is strict: 8 for `q = 4`.
#[test]
fn the_compression_exponent_is_bounded_by_theorem_4_7() {
    let covered = |compression: f64| {
        let exponents = PowerExponents {
            compression,
            ..PowerExponents::default()
        };
        Power::<3>::null_lagrangian(crate::common::moduli(1.0, 1.0), exponents, None)
            .unwrap()
            .hypotheses()
            .homeomorphism_theorem()
    };
    assert!(!covered(8.0));
    assert!(covered(8.5));
}

/// The inverse model of the default law: growth 1 in `|A|`, and `D^-1` under compression.
#[test]
fn the_inverse_model_trades_growth() {
    let hypotheses =
        Inverse::new(LogDet::<2>::new(crate::common::moduli(1.0, 1.0)).unwrap()).hypotheses();
    assert_eq!(hypotheses.growth.norm, 1.0);
    assert_eq!(hypotheses.growth.compression, 1.0);
    assert!(hypotheses.barrier);
    // Without bulk modulus a uniform collapse in 2D costs a finite energy.
    let soft = Inverse::new(LogDet::<2>::new(crate::common::moduli(0.0, 1.0)).unwrap());
    assert!(!soft.hypotheses().barrier);
    assert!(soft.value(&diagonal::<2>(&[-1.0 + 1e-6; 2])) < 1.1);
}

#[test]
fn reports_are_plain_data() {
    let hypotheses = LogDet::<3>::new(crate::common::moduli(1.0, 1.0))
        .unwrap()
        .hypotheses();
    let report = serde_json::to_value(hypotheses).unwrap();
    assert_eq!(report["polyconvex"], true);
    assert_eq!(report["growth"]["norm"], 2.0);
}
