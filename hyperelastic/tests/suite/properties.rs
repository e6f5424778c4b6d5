//! What every law must satisfy, on random deformations, in 2D and 3D.

use crate::common::law::{Law, PolyconvexLaw};
use crate::common::*;
use fe_grid::{Tensor, tensor};
use hyperelastic::{ViscousDissipation, cauchy_stress};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::any::Any;
use std::fmt::Debug;

const FAILURES: &str = "proptest-regressions/properties.txt";

type Outcome = Result<(), TestCaseError>;

/// Size of all that enters the value and the derivatives at a state: what rounding is relative to.
fn magnitude<const D: usize>(law: &dyn Law<D>, h: &Matrix<D>) -> f64 {
    let tangent: f64 = units::<D>()
        .iter()
        .map(|e| norm(&law.hessian_action(h, e)))
        .sum();
    let (value, stress) = law.gradient(h);
    value + norm(&stress) + tangent
}

/// `W(QA) = W(A)`, and `W_,A(QA) = Q W_,A(A)`.
fn frame_indifference<const D: usize>(law: &dyn Law<D>, h: &Matrix<D>, q: &Matrix<D>) -> Outcome {
    let turned = minus_identity(&tensor::product(q, &tensor::add_identity(h)));
    let ((w, p), (w_turned, p_turned)) = (law.gradient(h), law.gradient(&turned));
    // Rounding of the product, amplified by the derivatives.
    let tolerance = 1e-13 * magnitude(law, h);
    prop_assert!((w - w_turned).abs() <= tolerance, "{w} {w_turned}");
    prop_assert!(distance(&p_turned, &tensor::product(q, &p)) <= 10.0 * tolerance);
    Ok(())
}

/// `W(AQ) = W(A)`, and `W_,A(AQ) = W_,A(A) Q`.
fn isotropy<const D: usize>(law: &dyn Law<D>, h: &Matrix<D>, q: &Matrix<D>) -> Outcome {
    let turned = minus_identity(&tensor::product(&tensor::add_identity(h), q));
    let ((w, p), (w_turned, p_turned)) = (law.gradient(h), law.gradient(&turned));
    let tolerance = 1e-13 * magnitude(law, h);
    prop_assert!((w - w_turned).abs() <= tolerance, "{w} {w_turned}");
    prop_assert!(distance(&p_turned, &tensor::product(&p, q)) <= 10.0 * tolerance);
    Ok(())
}

/// Zero energy and stress on rotations, positive energy elsewhere.
fn minimum_on_rotations<const D: usize>(
    law: &dyn Law<D>,
    q: &Matrix<D>,
    stretches: &[f64; 3],
    a: &Matrix<D>,
) -> Outcome {
    let (value, stress) = law.gradient(&minus_identity(q));
    let stiffness = magnitude(law, &tensor::zero());
    prop_assert!(value.abs() <= 1e-14 * stiffness, "{value}");
    prop_assert!(norm(&stress) <= 1e-14 * stiffness, "{stress:?}");
    let away: f64 = stretches[..D].iter().map(|s| (s - 1.0).powi(2)).sum();
    let value = law.value(&minus_identity(a));
    // Near the rotations W is at least mu times the squared distance.
    prop_assert!(
        value >= 0.05 * law.moduli().mu * away,
        "{value} at distance {}",
        away.sqrt()
    );
    Ok(())
}

/// At the identity the value and the stress are exactly zero, in every law that is stress free.
fn zero_at_identity<const D: usize>(law: &dyn Law<D>) {
    let (value, stress) = law.gradient(&tensor::zero::<f64, D>());
    assert_eq!((value, norm(&stress)), (0.0, 0.0));
    assert_eq!(law.value(&tensor::zero::<f64, D>()), 0.0);
}

/// `W_,AA(1)[B] : B = 2 diss[B]` and `W_,AA(1)[B]` is the viscous stress.
fn lemma_6_4<const D: usize>(law: &dyn Law<D>, b: &Matrix<D>) -> Outcome {
    let viscous = ViscousDissipation {
        moduli: law.moduli(),
    };
    let action = law.hessian_action(&tensor::zero(), b);
    let scale = (law.moduli().lambda + law.moduli().mu) * (1.0 + norm(b).powi(2));
    let (found, expected) = (tensor::contract(&action, b), 2.0 * viscous.rate(b));
    prop_assert!(
        (found - expected).abs() <= 1e-12 * scale,
        "{found} {expected}"
    );
    prop_assert!(distance(&action, &viscous.stress(b)) <= 1e-12 * scale);
    Ok(())
}

/// `W_,AA(A)[B] : C = W_,AA(A)[C] : B`.
fn symmetry<const D: usize>(
    law: &dyn Law<D>,
    h: &Matrix<D>,
    b: &Matrix<D>,
    c: &Matrix<D>,
) -> Outcome {
    let left = tensor::contract(&law.hessian_action(h, b), c);
    let right = tensor::contract(&law.hessian_action(h, c), b);
    prop_assert!((left - right).abs() <= 1e-13 * magnitude(law, h) * (1.0 + norm(b) * norm(c)));
    Ok(())
}

/// Root of the sum of squares, over some directions of full rank, of what the Taylor polynomials of the value
/// (first and second order) and of the stress (first order) leave over at a step.
fn taylor_errors<const D: usize>(
    law: &dyn Law<D>,
    h: &Matrix<D>,
    directions: &[Matrix<D>],
    t: f64,
) -> [f64; 3] {
    let (value, stress) = law.gradient(h);
    let mut squares = [0.0; 3];
    for b in directions {
        let (moved, moved_stress) = law.gradient(&tensor::add_scaled(h, t, b));
        let action = law.hessian_action(h, b);
        let first = moved - value - t * tensor::contract(&stress, b);
        let second = first - 0.5 * t * t * tensor::contract(&action, b);
        let rest = distance(&moved_stress, &tensor::add_scaled(&stress, t, &action));
        for (square, error) in squares.iter_mut().zip([first, second, rest]) {
            *square += error * error;
        }
    }
    squares.map(f64::sqrt)
}

/// The derivatives belong to the value: errors fall as `t^2`, `t^3` and `t^2`. For a quadratic law
/// the last two vanish.
///
/// The next term of the series changes the slopes by some `t |W'''| / |W''|`, a few per cent. Where the
/// leading term happens to be small it is more, and a quarter of the step must do; with a wrong
/// derivative the slopes are smaller by one at all steps.
fn taylor_slopes<const D: usize>(
    law: &dyn Law<D>,
    h: &Matrix<D>,
    directions: &[Matrix<D>],
) -> Outcome {
    let rounding = 1e-14 * magnitude(law, h);
    let errors = |exponent: i32| taylor_errors(law, h, directions, 2f64.powi(exponent));
    let steps = [-9, -11].map(|exponent| [errors(exponent), errors(exponent - 1)]);
    for (i, order) in [2.0, 3.0, 2.0].into_iter().enumerate() {
        if steps[0][0][i] < 100.0 * rounding {
            prop_assert!(law.name() == "linear" && i > 0, "{:?}", steps[0][0]);
            continue;
        }
        let slopes = steps.map(|[coarse, fine]| (coarse[i] / fine[i]).log2());
        let right = |slope: f64| (slope - order).abs() < 0.1;
        let measured = steps[1][0][i] >= 100.0 * rounding;
        prop_assert!(
            right(slopes[0]) || measured && right(slopes[1]),
            "{i}: {slopes:?}"
        );
    }
    Ok(())
}

/// One policy: the value is infinite and the stress is not a number.
fn infinite_where_folded<const D: usize>(law: &dyn Law<D>, h: &Matrix<D>) -> Outcome {
    let mut folded = tensor::add_identity(h);
    for x in &mut folded[0] {
        *x = -*x;
    }
    let mut flat = tensor::add_identity(h);
    flat[0] = [0.0; D];
    let mut undefined = *h;
    undefined[0][0] = f64::NAN;
    let point = tensor::zero::<f64, D>();
    for h in [
        minus_identity(&folded),
        minus_identity(&flat),
        minus_identity(&point),
        undefined,
    ] {
        let (value, stress) = law.gradient(&h);
        prop_assert_eq!(value, f64::INFINITY);
        prop_assert_eq!(law.value(&h), f64::INFINITY);
        prop_assert!(norm(&stress).is_nan());
        prop_assert!(norm(&law.hessian_action(&h, &point)).is_nan());
    }
    Ok(())
}

fn narrow<const D: usize>(a: &Matrix<D>) -> Tensor<f32, D> {
    a.map(|row| row.map(|x| x as f32))
}

fn wide<const D: usize>(a: &Tensor<f32, D>) -> Matrix<D> {
    a.map(|row| row.map(f64::from))
}

/// Single precision gives the double precision result of the same (rounded) arguments.
fn single_precision<const D: usize>(law: &dyn Law<D>, h: &Matrix<D>, b: &Matrix<D>) -> Outcome {
    let (h32, b32) = (narrow(h), narrow(b));
    let (h, b) = (wide(&h32), wide(&b32));
    let (value, stress) = law.gradient(&h);
    let (value32, stress32) = law.gradient(&h32);
    // Forming A rounds it by 1e-7, and the tangent amplifies that: a factor of about ten for
    // states that are compressed to 4 %.
    let tolerance = 2e-6 * magnitude(law, &h);
    prop_assert!((value - f64::from(value32)).abs() <= tolerance);
    prop_assert!((value - f64::from(law.value(&h32))).abs() <= tolerance);
    prop_assert!(distance(&stress, &wide(&stress32)) <= tolerance);
    let action = law.hessian_action(&h, &b);
    let action32 = wide(&law.hessian_action(&h32, &b32));
    prop_assert!(
        distance(&action, &action32) <= 10.0 * tolerance,
        "{} {}",
        distance(&action, &action32),
        tolerance
    );
    Ok(())
}

/// Value and stress at strains of 1e-6, against integrals of the tangent, which is of order one:
/// `W(h) = int (1-t) W''(th)[h]:h dt`, `P(h) = int W''(th)[h] dt`. One-point rules, at 1/3 and 1/2,
/// leave a relative error of the order of 1e-12 times the ratio of fourth to second derivatives.
fn small_strains_keep_digits<const D: usize>(law: &dyn Law<D>, b: &Matrix<D>) -> Outcome {
    let symmetric = norm(&tensor::symmetric_part(b));
    prop_assume!(symmetric > 0.3 * norm(b) && symmetric > 1e-2);
    let h = tensor::scale(b, 1e-6 / norm(b));
    let (value, stress) = law.gradient(&h);
    let third = law.hessian_action(&tensor::scale(&h, 1.0 / 3.0), &h);
    let expected = 0.5 * tensor::contract(&third, &h);
    prop_assert!(
        (value - expected).abs() <= 1e-10 * expected,
        "{value} {expected}"
    );
    let expected = law.hessian_action(&tensor::scale(&h, 0.5), &h);
    prop_assert!(distance(&stress, &expected) <= 1e-10 * norm(&expected));
    Ok(())
}

/// The Cauchy stress is symmetric (balance of angular momentum) and turns with the frame.
fn cauchy_is_symmetric<const D: usize>(law: &dyn Law<D>, h: &Matrix<D>, q: &Matrix<D>) -> Outcome {
    let at = |h: &Matrix<D>| cauchy_stress(h, &law.gradient(h).1);
    let sigma = at(h);
    let scale = 1e-12 * magnitude(law, h) / tensor::determinant(&tensor::add_identity(h));
    prop_assert!(distance(&sigma, &tensor::transpose(&sigma)) <= scale);
    let turned = at(&minus_identity(&tensor::product(
        q,
        &tensor::add_identity(h),
    )));
    let expected = tensor::product_transposed(&tensor::product(q, &sigma), q);
    prop_assert!(distance(&turned, &expected) <= 10.0 * scale);
    Ok(())
}

/// The form in independent arguments is the law on matrices, and convex along segments that leave
/// them.
fn polyconvexity<const D: usize>(
    law: &dyn PolyconvexLaw<D>,
    h: &Matrix<D>,
    ends: &[(Matrix<D>, Matrix<D>, f64); 2],
    t: f64,
) -> Outcome {
    prop_assert!(law.hypotheses().polyconvex);
    let a = tensor::add_identity(h);
    let value = law.polyconvex_value(&a, &tensor::cofactor(&a), tensor::determinant(&a));
    let tolerance = 1e-12 * (1.0 + magnitude(law, h));
    prop_assert!((value - law.value(h)).abs() <= tolerance);

    let mix = |a: &Matrix<D>, b: &Matrix<D>| {
        tensor::add(&tensor::scale(a, 1.0 - t), &tensor::scale(b, t))
    };
    let [(a0, c0, d0), (a1, c1, d1)] = ends;
    let (w0, w1) = (
        law.polyconvex_value(a0, c0, *d0),
        law.polyconvex_value(a1, c1, *d1),
    );
    let between = law.polyconvex_value(&mix(a0, a1), &mix(c0, c1), (1.0 - t) * d0 + t * d1);
    let chord = (1.0 - t) * w0 + t * w1;
    prop_assert!(
        between <= chord + 1e-12 * (1.0 + w0.abs() + w1.abs()),
        "{between} above {chord}"
    );
    let out = law.polyconvex_value(a0, c0, -d0);
    prop_assert_eq!(out, f64::INFINITY);
    Ok(())
}

/// Any matrices and any positive determinant, unrelated.
fn independent<const D: usize>() -> impl Strategy<Value = (Matrix<D>, Matrix<D>, f64)> {
    (direction::<D>(), direction::<D>(), -3.0f64..2.0)
        .prop_map(|(a, c, e)| (tensor::scale(&a, 3.0), tensor::scale(&c, 3.0), e.exp()))
}

/// What a strategy has made, of any type.
trait Made: Any + Debug {}

impl<T: Any + Debug> Made for T {}

/// Tries a property on values of a strategy. Neither is a type parameter of proptest's machinery, which is large
/// and would be compiled for each property.
fn check<S: Strategy + 'static>(strategy: S, property: &dyn Fn(S::Value) -> Outcome) {
    let hidden = strategy.prop_map(|value| -> Box<dyn Made> { Box::new(value) });
    run(&hidden.boxed(), &|value| {
        let value: Box<dyn Any> = value;
        property(*value.downcast().expect("made by this strategy"))
    });
}

fn run(strategy: &BoxedStrategy<Box<dyn Made>>, property: &dyn Fn(Box<dyn Made>) -> Outcome) {
    let mut runner = TestRunner::new(config(FAILURES));
    if let Err(error) = runner.run(strategy, property) {
        panic!("{error}");
    }
}

/// Properties of every law, linear elasticity included.
macro_rules! smooth_law {
    ($law:ident, $d:literal) => {
        #[test]
        fn is_zero_at_the_identity() {
            zero_at_identity(&$law::<$d>());
        }
        #[test]
        fn satisfies_lemma_6_4() {
            let law = $law::<$d>();
            check(direction::<$d>(), &|b| lemma_6_4(&law, &b));
        }
        #[test]
        fn has_symmetric_hessian() {
            let law = $law::<$d>();
            let states = (admissible::<$d>(), direction::<$d>(), direction::<$d>());
            check(states, &|(h, b, c)| symmetry(&law, &h, &b, &c));
        }
        #[test]
        fn has_taylor_slopes() {
            let law = $law::<$d>();
            let states = (moderate::<$d>(), prop::array::uniform6(direction::<$d>()));
            check(states, &|(h, b)| taylor_slopes(&law, &h, &b));
        }
        #[test]
        fn agrees_in_single_precision() {
            let law = $law::<$d>();
            let states = (admissible::<$d>(), direction::<$d>());
            check(states, &|(h, b)| single_precision(&law, &h, &b));
        }
        #[test]
        fn keeps_digits_of_small_strains() {
            let law = $law::<$d>();
            check(direction::<$d>(), &|b| small_strains_keep_digits(&law, &b));
        }
    };
}

/// Properties of the nonlinear laws.
macro_rules! finite_strain_law {
    ($law:ident, $d:literal) => {
        smooth_law!($law, $d);
        #[test]
        fn is_frame_indifferent() {
            let law = $law::<$d>();
            let states = (admissible::<$d>(), any_rotation::<$d>());
            check(states, &|(h, q)| frame_indifference(&law, &h, &q));
        }
        #[test]
        fn is_isotropic() {
            let law = $law::<$d>();
            let states = (admissible::<$d>(), any_rotation::<$d>());
            check(states, &|(h, q)| isotropy(&law, &h, &q));
        }
        #[test]
        fn has_its_minimum_on_rotations() {
            let law = $law::<$d>();
            let states = (any_rotation::<$d>(), stretched::<$d>(0.3, 2.5));
            check(states, &|(q, (s, a))| {
                minimum_on_rotations(&law, &q, &s, &a)
            });
        }
        #[test]
        fn is_infinite_where_folded() {
            let law = $law::<$d>();
            check(admissible::<$d>(), &|h| infinite_where_folded(&law, &h));
        }
        #[test]
        fn has_symmetric_cauchy_stress() {
            let law = $law::<$d>();
            let states = (admissible::<$d>(), any_rotation::<$d>());
            check(states, &|(h, q)| cauchy_is_symmetric(&law, &h, &q));
        }
        #[test]
        fn is_polyconvex() {
            let law = $law::<$d>();
            let pair = (independent::<$d>(), independent::<$d>());
            let states = (admissible::<$d>(), pair, 0.0f64..1.0);
            check(states, &|(h, (first, second), t)| {
                polyconvexity(&law, &h, &[first, second], t)
            });
        }
    };
}

/// A law registers here, in both dimensions.
macro_rules! register {
    ($kind:ident: $($law:ident),*) => {
        $(mod $law {
            mod in_2d {
                use super::super::*;
                $kind!($law, 2);
            }
            mod in_3d {
                use super::super::*;
                $kind!($law, 3);
            }
        })*
    };
}

register!(
    finite_strain_law: logdet, logdet_stiff, logdet_barrier, logdet_barrier_odd, power,
    power_soft, power_two_term, power_odd, inverse_logdet, inverse_power
);
register!(smooth_law: linear);
