//! Smooth steps: derivatives, integrals, and the reference values.

use approx::assert_relative_eq;
use levelset::{Arctan, Compact};
use proptest::prelude::*;

proptest! {
    #[test]
    fn derivatives_match_differences(x in -2.0f64..2.0, width in 0.1f64..1.5) {
        // Central differences: error h^2/6 |H'''| + rounding/h, with |H'''| <= 2/width^3.
        let h = 1e-5;
        let bound = h * h / width.powi(3) + 1e-10;
        let arctan = Arctan::new(width).unwrap();
        let slope = (arctan.value(x + h) - arctan.value(x - h)) / (2.0 * h);
        prop_assert!((slope - arctan.derivative(x)).abs() < bound);
        let bend = (arctan.derivative(x + h) - arctan.derivative(x - h)) / (2.0 * h);
        prop_assert!((bend - arctan.second_derivative(x)).abs() < 100.0 * bound / width);
        // The cubic's second derivative jumps at the ends, by 3/(2 w^2): one order less there.
        let compact = Compact::new(width).unwrap();
        let slope = (compact.value(x + h) - compact.value(x - h)) / (2.0 * h);
        prop_assert!((slope - compact.derivative(x)).abs() < bound + 2.0 * h / width.powi(2));
    }

    #[test]
    fn steps_are_odd_about_one_half_and_rise(x in -3.0f64..3.0, width in 0.05f64..2.0) {
        let arctan = Arctan::new(width).unwrap();
        let compact = Compact::new(width).unwrap();
        prop_assert!((arctan.value(x) + arctan.value(-x) - 1.0).abs() < 1e-15);
        prop_assert!((compact.value(x) + compact.value(-x) - 1.0).abs() < 1e-15);
        prop_assert!(compact.derivative(x) >= 0.0 && arctan.derivative(x) > 0.0);
        if x.abs() >= width {
            prop_assert_eq!(compact.value(x), f64::from(u8::from(x > 0.0)));
            prop_assert_eq!(compact.derivative(x), 0.0);
        }
    }
}

#[test]
fn widths_must_be_positive() {
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Arctan::new(width).is_err());
        assert!(Compact::new(width).is_err());
    }
}

#[test]
fn arctan_oracle() {
    let Some(reference) = test_support::oracle("heaviside.json") else {
        return;
    };
    let cases = reference["cases"].as_array().unwrap();
    assert!(!cases.is_empty());
    for case in cases {
        let number = |key: &str| test_support::number(case, key);
        let step = Arctan::new(number("eps")).unwrap();
        let x = number("x");
        assert_relative_eq!(step.value(x), number("H"), max_relative = 1e-10);
        assert_relative_eq!(step.derivative(x), number("dH"), max_relative = 1e-10);
    }
}
