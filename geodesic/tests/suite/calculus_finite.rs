//! Exponential map, logarithm and transport where they are known in closed form.

use approx::assert_relative_eq;
use geodesic::calculus::{FiniteSpace, Ladder, PathSpace};
use geodesic::finite::{Balls, Rule, StereographicSphere, finite_geodesic};
use hyperelastic::LawSpec;
use proptest::prelude::*;

const START: [f64; 2] = [0.9, -0.3];
const VELOCITY: [f64; 2] = [-0.7, 0.8];
const VARIATION: [f64; 2] = [0.5, 0.4];

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn sphere(rule: Rule) -> StereographicSphere {
    StereographicSphere { rule }
}

/// The path that shoots with the velocity from the start in so many steps.
fn shot(rule: Rule, steps: usize) -> Vec<[f64; 2]> {
    let sphere = sphere(rule);
    let mut space = FiniteSpace {
        dissimilarity: &sphere,
    };
    let second = space.combination(1.0, &START, 1.0 / steps as f64, &VELOCITY);
    let mut path = vec![START, second];
    path.extend(space.exponential(&START, &second, steps - 1).unwrap());
    assert_eq!(path.len(), steps + 1);
    path
}

/// The order by which an error falls from 32 steps to 64.
fn order(error: impl Fn(usize) -> f64) -> f64 {
    (error(32) / error(64)).log2()
}

/// Points of the great circle that leaves the start with the velocity.
fn circle(steps: usize) -> Vec<[f64; 2]> {
    let point = |k: usize| {
        let t = k as f64 / steps as f64;
        StereographicSphere::exponential(&START, &VELOCITY.map(|v| t * v))
    };
    (0..=steps).map(point).collect()
}

#[test]
fn shooting_converges_to_the_great_circle() {
    let exact = StereographicSphere::exponential(&START, &VELOCITY);
    for rule in [Rule::Left, Rule::Midpoint] {
        let found = order(|steps| distance(shot(rule, steps)[steps], exact));
        // The first step is a chord, which is turned against the tangent by O(1/K).
        assert!((0.9..1.1).contains(&found), "{rule:?}: {found}");
    }
    // With a first step that lies on the circle, what is left is the order of the rule.
    let after_arc = |rule| {
        order(|steps| {
            let sphere = sphere(rule);
            let mut space = FiniteSpace {
                dissimilarity: &sphere,
            };
            let second = circle(steps)[1];
            let rest = space.exponential(&START, &second, steps - 1).unwrap();
            distance(rest[steps - 2], exact)
        })
    };
    let (first, second) = (after_arc(Rule::Left), after_arc(Rule::Midpoint));
    assert!((0.9..1.1).contains(&first), "{first}");
    assert!((1.9..2.1).contains(&second), "{second}");
}

#[test]
fn logarithms_converge() {
    let end = StereographicSphere::exponential(&START, &VELOCITY);
    for rule in [Rule::Left, Rule::Midpoint] {
        let found = order(|steps| {
            let sphere = sphere(rule);
            let path = finite_geodesic(&sphere, START, end, steps).unwrap();
            let space = FiniteSpace {
                dissimilarity: &sphere,
            };
            distance(space.logarithm(&path.points).unwrap(), VELOCITY)
        });
        assert!((0.9..1.1).contains(&found), "{rule:?}: {found}");
    }
}

#[test]
fn transport_converges_along_a_great_circle() {
    let exact = |steps: usize| {
        let end = circle(steps)[steps];
        StereographicSphere::transport(&START, &end, &VARIATION)
    };
    let error = |rule, symmetric, steps: usize| {
        let sphere = sphere(rule);
        let mut space = FiniteSpace {
            dissimilarity: &sphere,
        };
        let ladder = Ladder {
            symmetric,
            ..Ladder::default()
        };
        let carried = space.transport(&circle(steps), &VARIATION, ladder);
        distance(carried.unwrap().unwrap(), exact(steps))
    };
    // One-sided rungs of the length 1/K leave a part of first order, which is even in the length;
    // the metric at one end of a step leaves another.
    let one_sided = order(|k| error(Rule::Midpoint, false, k));
    assert!((0.9..1.1).contains(&one_sided), "{one_sided}");
    let symmetric = order(|k| error(Rule::Midpoint, true, k));
    assert!((1.9..2.1).contains(&symmetric), "{symmetric}");
    let left = order(|k| error(Rule::Left, true, k));
    assert!((0.9..1.1).contains(&left), "{left}");
    assert!(error(Rule::Midpoint, true, 16) < 0.1 * error(Rule::Midpoint, false, 16));
}

#[test]
fn a_geodesic_carries_its_tangent_to_its_tangent() {
    // By one-sided rungs exactly: both sides of the ladder are the path itself.
    let path = shot(Rule::Left, 8);
    let sphere = sphere(Rule::Left);
    let mut space = FiniteSpace {
        dissimilarity: &sphere,
    };
    let tangent = space.logarithm(&path).unwrap();
    let ladder = Ladder {
        symmetric: false,
        ..Ladder::default()
    };
    let carried = space.transport(&path, &tangent, ladder).unwrap().unwrap();
    let next = space.exponential(&path[7], &path[8], 1).unwrap()[0];
    let ahead = space.combination(8.0, &next, -8.0, &path[8]);
    // Rounding of the solutions, times 1/s = 8 for each of eight rungs.
    assert!(distance(carried, ahead) < 1e-11, "{carried:?} {ahead:?}");
}

#[test]
fn balls_grow_as_their_metric_says() {
    // In the metric 2 pi (lambda + mu) r'^2 of disks r grows linearly, in that of balls,
    // proportional to r r'^2, the power 3/2 of r does.
    fn error<const D: usize>(steps: usize) -> f64 {
        let balls = Balls::<D>::new(LawSpec::default()).unwrap();
        let mut space = FiniteSpace {
            dissimilarity: &balls,
        };
        let (start, speed): (f64, f64) = (0.2, 0.1);
        let power = D as f64 / 2.0;
        let at = |t: f64| {
            let rate = power * start.powf(power - 1.0) * speed;
            (start.powf(power) + rate * t).powf(1.0 / power)
        };
        let second = at(1.0 / steps as f64);
        let found = space.exponential(&[start], &[second], steps - 1).unwrap();
        (found[steps - 2][0] - at(1.0)).abs()
    }
    let flat = order(error::<2>);
    assert!((1.9..2.1).contains(&flat), "{flat}");
    // Errors of both orders cancel for some tens of steps.
    let solid = (error::<3>(512) / error::<3>(1024)).log2();
    assert!((0.9..1.1).contains(&solid), "{solid}");
    assert!(error::<2>(16) < 2e-5 && error::<3>(16) < 2e-5);
}

#[test]
fn what_has_no_solution_is_none() {
    let balls = Balls::<2>::new(LawSpec::default()).unwrap();
    let mut space = FiniteSpace {
        dissimilarity: &balls,
    };
    // No ball of positive radius follows one that has shrunk to a hundredth.
    let found = space.exponential(&[1.0], &[0.01], 3).unwrap();
    assert!(found.len() < 3, "{found:?}");
    assert_eq!(space.logarithm(&[[1.0]]), None);
}

fn point() -> impl Strategy<Value = [f64; 2]> {
    [-1.0..1.0f64, -1.0..1.0f64]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The closed forms fit together.
    #[test]
    fn closed_forms_agree(x in point(), v in point(), w in point()) {
        let length = |x: &[f64; 2], v: &[f64; 2]| {
            2.0 * v[0].hypot(v[1]) / (1.0 + x[0] * x[0] + x[1] * x[1])
        };
        let y = StereographicSphere::exponential(&x, &v);
        prop_assume!(length(&x, &v) < 3.0);
        // Rounding, where the chart is stretched and near the opposite point.
        assert_relative_eq!(StereographicSphere::distance(&x, &y), length(&x, &v), max_relative = 1e-9, epsilon = 1e-12);
        let back = StereographicSphere::logarithm(&x, &y);
        prop_assert!(distance(back, v) < 1e-8);
        let carried = StereographicSphere::transport(&x, &y, &w);
        assert_relative_eq!(length(&y, &carried), length(&x, &w), max_relative = 1e-9);
        // The tangent stays the tangent: backward it is the logarithm.
        let tangent = StereographicSphere::transport(&x, &y, &v);
        let reverse = StereographicSphere::logarithm(&y, &x);
        let size = 1.0 + tangent[0].hypot(tangent[1]);
        prop_assert!(distance(tangent, reverse.map(|t| -t)) < 1e-7 * size);
    }

    /// A geodesic, continued from its first step, is itself; the midpoint of two of its steps is
    /// the point between them.
    #[test]
    fn shooting_inverts_geodesics(a in point(), by in point(), steps in 2usize..6) {
        // Far points may have several stationary midpoints.
        let b = [a[0] + 0.4 * by[0], a[1] + 0.4 * by[1]];
        for rule in [Rule::Left, Rule::Midpoint] {
            let sphere = StereographicSphere { rule };
            let path = finite_geodesic(&sphere, a, b, steps).unwrap().points;
            let mut space = FiniteSpace { dissimilarity: &sphere };
            let rest = space.exponential(&path[0], &path[1], steps - 1).unwrap();
            prop_assert_eq!(rest.len(), steps - 1);
            for (found, asked) in rest.iter().zip(&path[2..]) {
                // Newton's method of the geodesic ends at gradients of 1e-13 of the first.
                prop_assert!(distance(*found, *asked) < 1e-8);
            }
            let middle = space.midpoint(&path[0], &path[2]).unwrap().unwrap();
            prop_assert!(distance(middle, path[1]) < 1e-8);
        }
    }
}
