//! A law of another crate runs in all theories, by its name.

#[path = "../../examples/own_law.rs"]
#[allow(dead_code, reason = "the example has a main function")]
mod example;

use example::{NeoHookean, compute, registered};
use fe_grid::{Tensor, tensor};
use hyperelastic::{CompiledLaw, LameModuli, LawError, LawSpec, ViscousDissipation, register_law};

/// A displacement gradient with a rotation and unequal stretches.
fn strained<const D: usize>(scale: f64) -> Tensor<f64, D> {
    std::array::from_fn(|i| std::array::from_fn(|k| scale * ((3 * i + 2 * k + 1) as f64).sin()))
}

fn derivatives<const D: usize>() {
    let moduli = LameModuli {
        lambda: 1.3,
        mu: 0.7,
    };
    let law = law::<D>(moduli);
    let (h, b) = (strained::<D>(0.2), strained::<D>(-0.9));
    let moved = |t: f64| tensor::add(&h, &tensor::scale(&b, t));
    let (value, stress) = law.gradient(&h);
    assert_eq!(value.to_bits(), law.value(&h).to_bits());
    // Central differences: their error is of the order of t^2 and of rounding over t.
    let t = 1e-5;
    let slope = (law.value(&moved(t)) - law.value(&moved(-t))) / (2.0 * t);
    assert!((slope - tensor::contract(&stress, &b)).abs() < 1e-8);
    let change = tensor::sub(&law.gradient(&moved(t)).1, &law.gradient(&moved(-t)).1);
    let change = tensor::scale(&change, 0.5 / t);
    let error = tensor::sub(&change, &law.hessian_action(&h, &b));
    assert!(tensor::contract(&error, &error).sqrt() < 1e-8);
    let rest = law.hessian_action(&tensor::zero(), &b);
    let linear = ViscousDissipation { moduli }.stress(&b);
    let error = tensor::sub(&rest, &linear);
    assert!(tensor::contract(&error, &error).sqrt() < 1e-12);
}

fn law<const D: usize>(moduli: LameModuli) -> CompiledLaw<D> {
    CompiledLaw::new(NeoHookean::new(moduli))
}

#[test]
fn the_law_of_the_example_is_its_own_derivative() {
    derivatives::<2>();
    derivatives::<3>();
}

#[test]
fn a_law_of_another_crate_runs_in_all_theories() {
    let moduli = LameModuli {
        lambda: 1.0,
        mu: 1.0,
    };
    let own = registered(moduli).unwrap();
    // It has a name like any other from now on, once.
    assert_eq!("neo_hookean".parse(), Ok(own.law));
    assert_eq!(serde_json::to_value(own.law).unwrap(), "neo_hookean");
    let again = register_law("neo_hookean", |_| unreachable!(), |_| unreachable!());
    assert!(matches!(again, Err(LawError::NameTaken { .. })));
    let taken = register_law("logdet", |_| unreachable!(), |_| unreachable!());
    assert!(matches!(taken, Err(LawError::NameTaken { .. })));
    for name in ["", "inverse:own", "two words"] {
        let refused = register_law(name, |_| unreachable!(), |_| unreachable!());
        assert!(matches!(refused, Err(LawError::BadName { .. })));
    }

    let found = compute(own).unwrap();
    let known = compute(LawSpec::default()).unwrap();
    // The disks differ along one direction of shape space only.
    assert!((found.radius - 0.24).abs() < 0.005, "{found:?}");
    assert!(found.first_mode > 0.9, "{found:?}");
    // Both laws have the same linearisation, and differ beyond it.
    let ratio = found.length / known.length;
    assert!((ratio - 1.0).abs() < 0.2, "{found:?} {known:?}");
    assert!((ratio - 1.0).abs() > 1e-4, "the law is not the default one");
}
