//! Verdicts on outcomes.

use shapespace_verify::outcome::Expectation;
use shapespace_verify::verdict::Verdict;
use shapespace_verify::{Ingredient, Outcome};

fn outcome(measured: f64, expected: Expectation) -> Outcome {
    let mut outcome = Outcome::default();
    outcome.check("x", measured, 0.0, expected, "");
    outcome
}

#[test]
fn figures_decide() {
    let value = Expectation::Value {
        value: 1.0,
        tolerance: 0.1,
    };
    let order = Expectation::Order {
        order: 2.0,
        tolerance: 0.15,
    };
    for (measured, expected, well) in [
        (1.05, value, true),
        (1.2, value, false),
        (f64::NAN, value, false),
        (2.1, order, true),
        (1.8, order, false),
        (1.0, Expectation::AtMost(1.0), true),
        (1.1, Expectation::AtMost(1.0), false),
        (f64::NAN, Expectation::AtMost(1.0), false),
        (1.0, Expectation::AtLeast(1.0), true),
        (f64::NAN, Expectation::AtLeast(1.0), false),
    ] {
        let verdict = Verdict::of(&outcome(measured, expected), Ingredient::Sound);
        assert_eq!(
            verdict == Verdict::Confirmed,
            well,
            "{measured} {expected:?}"
        );
        assert_eq!(verdict.is_well(Ingredient::Sound), well);
        assert_eq!(verdict.is_well(Ingredient::Broken), !well);
    }
}

#[test]
fn an_uncertain_order_is_none() {
    let mut outcome = Outcome::default();
    let expected = Expectation::Order {
        order: 2.0,
        tolerance: 0.15,
    };
    outcome.check("x", 2.0, 0.3, expected, "");
    assert_eq!(Verdict::of(&outcome, Ingredient::Sound).word(), "refuted");
}

#[test]
fn an_unmet_hypothesis_comes_first_unless_the_run_is_broken() {
    let mut outcome = outcome(2.0, Expectation::AtMost(1.0));
    outcome.condition("growth", false);
    let sound = Verdict::of(&outcome, Ingredient::Sound);
    assert_eq!(sound.word(), "not covered");
    assert!(sound.is_well(Ingredient::Sound));
    assert_eq!(Verdict::of(&outcome, Ingredient::Broken).word(), "refuted");
}
