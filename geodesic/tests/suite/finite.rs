//! Discrete geodesics whose limits are known.

use approx::assert_relative_eq;
use geodesic::GeodesicError;
use geodesic::finite::{
    Balls, Dashpots, Dissimilarity, FinitePath, Rule, StereographicSphere, finite_geodesic,
};
use hyperelastic::{LameModuli, LawSpec};
use proptest::prelude::*;
use test_support::oracle;

/// Differences of the values against the gradients.
fn check_gradients<W: Dissimilarity<N>, const N: usize>(w: &W, a: [f64; N], b: [f64; N]) {
    let (by_a, by_b) = w.gradients(&a, &b);
    let h = 1e-5;
    for i in 0..N {
        let shifted = |x: [f64; N], by: f64| {
            let mut x = x;
            x[i] += by;
            x
        };
        let slope_a = (w.value(&shifted(a, h), &b) - w.value(&shifted(a, -h), &b)) / (2.0 * h);
        let slope_b = (w.value(&a, &shifted(b, h)) - w.value(&a, &shifted(b, -h))) / (2.0 * h);
        // Central differences: the error is h^2 times third derivatives of order ten.
        assert_relative_eq!(by_a[i], slope_a, epsilon = 1e-6, max_relative = 1e-6);
        assert_relative_eq!(by_b[i], slope_b, epsilon = 1e-6, max_relative = 1e-6);
    }
}

fn point() -> impl Strategy<Value = [f64; 2]> {
    [-1.0..1.0f64, -1.0..1.0f64]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn gradients_match_differences(a in point(), b in point(), r in 0.2..0.4f64, s in 0.2..0.4f64) {
        for rule in [Rule::Left, Rule::Midpoint] {
            check_gradients(&StereographicSphere { rule }, a, b);
        }
        let law = LawSpec::new("logdet", LameModuli::new(1.3, 0.7).unwrap()).unwrap();
        check_gradients(&Balls::<2>::new(law).unwrap(), [r], [s]);
        check_gradients(&Balls::<3>::new(law).unwrap(), [r], [s]);
        let triangle = |x: [f64; 2]| [0.0, 0.0, 3.0 + x[0], x[1], x[1], 3.0 - x[0]];
        let dashpots = Dashpots { viscosity: 0.7, ground: 0.1 };
        check_gradients(&dashpots, triangle(a), triangle(b));
    }

    /// By Cauchy and Schwarz, and less than any other path that one can think of.
    #[test]
    fn dissipation_bounds_the_squared_length(a in point(), b in point(), steps in 1usize..9) {
        let sphere = StereographicSphere { rule: Rule::Midpoint };
        let path = finite_geodesic(&sphere, a, b, steps).unwrap();
        prop_assert!(path.length().powi(2) <= path.dissipation() * (1.0 + 1e-12));
        let straight: f64 = (0..steps)
            .map(|k| {
                let at = |k: usize| {
                    let t = k as f64 / steps as f64;
                    std::array::from_fn(|i| (1.0 - t) * a[i] + t * b[i])
                };
                sphere.value(&at(k), &at(k + 1))
            })
            .sum();
        prop_assert!(path.dissipation() <= steps as f64 * straight * (1.0 + 1e-12));
    }
}

const START: [f64; 2] = [0.9, -0.3];
const END: [f64; 2] = [-0.2, 1.1];

/// The order by which an error falls from `K = 32` to `K = 64`.
fn order(rule: Rule, error: impl Fn(&FinitePath<2>) -> f64) -> f64 {
    let sphere = StereographicSphere { rule };
    let at = |steps| error(&finite_geodesic(&sphere, START, END, steps).unwrap()).abs();
    (at(32) / at(64)).log2()
}

#[test]
fn lengths_on_the_sphere_converge_to_the_great_circle() {
    let exact = StereographicSphere::distance(&START, &END);
    let by_length = |path: &FinitePath<2>| path.length() - exact;
    let by_dissipation = |path: &FinitePath<2>| path.dissipation() - exact * exact;
    let second = order(Rule::Midpoint, by_length);
    assert!((1.9..2.1).contains(&second), "{second}");
    let second = order(Rule::Midpoint, by_dissipation);
    assert!((1.9..2.1).contains(&second), "{second}");
    // The metric at the start of every step: its error at one end of a step cancels against the
    // next but for those of the ends.
    let first = order(Rule::Left, by_length);
    assert!((0.9..1.1).contains(&first), "{first}");
}

#[test]
fn points_on_the_sphere_converge_to_the_great_circle() {
    // All points of a geodesic lie in the plane through the centre and both ends.
    let lift = |x: &[f64; 2]| {
        let s = x[0] * x[0] + x[1] * x[1];
        nalgebra::Vector3::new(2.0 * x[0], 2.0 * x[1], s - 1.0) / (1.0 + s)
    };
    let normal = lift(&START).cross(&lift(&END)).normalize();
    let distance = |steps| {
        let sphere = StereographicSphere {
            rule: Rule::Midpoint,
        };
        let path = finite_geodesic(&sphere, START, END, steps).unwrap();
        let off = path.points.iter().map(|x| lift(x).dot(&normal).abs());
        off.fold(0.0, f64::max)
    };
    let order = (distance(16) / distance(32)).log2();
    assert!((1.9..2.1).contains(&order), "{order}");
}

/// What stretches twice as far in two steps stores the same energy in springs, whatever was in
/// between, but dissipates in dashpots along the way.
#[test]
fn springs_forget_the_way_and_dashpots_do_not() {
    let dashpot = Dashpots {
        viscosity: 0.5,
        ground: 0.0,
    };
    let segment = |length: f64| [0.0, 0.0, length, 0.0];
    let direct = dashpot.value(&segment(1.0), &segment(2.0));
    let detour = [1.0, 2.5, 2.0];
    let along: f64 = detour
        .windows(2)
        .map(|pair| dashpot.value(&segment(pair[0]), &segment(pair[1])).sqrt())
        .sum();
    // One dashpot: the length is that of the way, sqrt(2 mu) (1.5 + .5).
    assert_relative_eq!(direct, 1.0, max_relative = 1e-14);
    assert_relative_eq!(along, 2.0, max_relative = 1e-14);
    let path = finite_geodesic(&dashpot_with_ground(), segment(1.0), segment(2.0), 8).unwrap();
    assert_relative_eq!(path.length(), 1.0, max_relative = 1e-3);
}

fn dashpot_with_ground() -> Dashpots {
    // The ground holds what is left of rigid motions; its own energy is a thousandth.
    Dashpots {
        viscosity: 0.5,
        ground: 1e-4,
    }
}

#[test]
fn oracle_balls() {
    let Some(file) = oracle("balls.json") else {
        return;
    };
    let mut checked = 0;
    for case in file["cases"].as_array().unwrap() {
        if case["kind"] != "ball_geodesic_hard" {
            continue;
        }
        let number = |key: &str| case[key].as_f64().unwrap();
        let moduli = LameModuli::new(number("lambda_"), number("mu")).unwrap();
        let law = LawSpec::new("logdet", moduli).unwrap();
        let (start, end) = ([number("R0")], [number("R1")]);
        let steps = case["K"].as_u64().unwrap() as usize;
        let path = if case["dim"] == 2 {
            finite_geodesic(&Balls::<2>::new(law).unwrap(), start, end, steps)
        } else {
            finite_geodesic(&Balls::<3>::new(law).unwrap(), start, end, steps)
        }
        .unwrap();
        // Energies are stationary in the radii: these are found to the root of their accuracy.
        assert_relative_eq!(path.length(), number("length"), max_relative = 1e-10);
        assert_relative_eq!(path.dissipation(), number("diss"), max_relative = 1e-10);
        for (point, radius) in path.points.iter().zip(case["radii"].as_array().unwrap()) {
            assert_relative_eq!(point[0], radius.as_f64().unwrap(), max_relative = 1e-7);
        }
        checked += 1;
    }
    assert_eq!(checked, 30);
}

#[test]
fn no_steps_are_refused() {
    let sphere = StereographicSphere { rule: Rule::Left };
    assert!(finite_geodesic(&sphere, START, END, 0).is_err());
}

#[test]
fn points_that_no_path_reaches_are_refused() {
    let law = LawSpec::new("logdet", LameModuli::new(1.0, 1.0).unwrap()).unwrap();
    let balls = Balls::<2>::new(law).unwrap();
    for end in [f64::NAN, f64::INFINITY, -0.2] {
        let refused = finite_geodesic(&balls, [0.2], [end], 4);
        let refused = matches!(refused, Err(GeodesicError::Parameter { .. }));
        assert!(refused, "{end}");
    }
}
