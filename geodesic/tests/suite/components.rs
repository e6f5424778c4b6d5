//! Shapes of several components, and shapes that are hidden in part.

use fe_grid::composition::{Interpolant, Outside};
use fe_grid::minimise::{Evaluation, Objective, Silent};
use fe_grid::random::noise;
use fe_grid::{Assembly, Data, Grid, ScalarField};
use geodesic::level_sets::LevelSetObjective;
use geodesic::{
    ComposedMismatch, Domain, DomainChoice, Form, Geodesic, GeodesicError, GeodesicParams,
    HeavisideMismatch, Known, Shape, StepMismatch, Visibility, geodesic, geodesic_between,
};
use levelset::{Arctan, Cause, signed_distance};
use proptest::prelude::*;

fn from<const D: usize>(level: u32, f: impl Fn([f64; D]) -> f64) -> ScalarField<f64, D> {
    let implicit = ScalarField::from_fn(Grid::dyadic(level), |x| [f(x)]);
    signed_distance(&implicit, 0.0).unwrap()
}

/// A rectangle given by its middle and half its sides.
fn rectangle(level: u32, middle: [f64; 2], half: [f64; 2]) -> ScalarField<f64, 2> {
    from(level, |[x, y]| {
        (half[0] - (x - middle[0]).abs()).min(half[1] - (y - middle[1]).abs())
    })
}

fn params(form: Form, steps: usize) -> GeodesicParams {
    GeodesicParams {
        form,
        steps,
        ..GeodesicParams::default()
    }
}

/// The derivative along a direction against central differences. Points on their way cross the faces
/// of cells, where the level set has a kink: of three steps, the shorter of which pass fewer faces, one must
/// agree.
#[track_caller]
fn check_slope(value: impl Fn(&[f64]) -> f64, gradient: &[f64], x: &[f64], direction: &[f64]) {
    let at = |t: f64| {
        let moved: Vec<f64> = x.iter().zip(direction).map(|(x, d)| x + t * d).collect();
        value(&moved)
    };
    let differences = [1e-6, 1e-7, 1e-8].map(|t| (at(t) - at(-t)) / (2.0 * t));
    let slope: f64 = gradient.iter().zip(direction).map(|(g, d)| g * d).sum();
    let scale: f64 = gradient
        .iter()
        .zip(direction)
        .map(|(g, d)| (g * d).abs())
        .sum();
    // Truncation, and rounding of 1e-8 at the shortest step, are far below this. A wrong factor anywhere
    // shows at a hundred times as much, at every step.
    let agrees = |difference: &f64| (difference - slope).abs() <= 2e-4 * scale;
    assert!(differences.iter().any(agrees), "{differences:?} {slope}");
}

fn smooth<const D: usize>(level: u32, seed: u64, size: f64) -> Vec<f64> {
    let c = noise(12, seed);
    let field = ScalarField::<f64, D>::from_fn(Grid::dyadic(level), |x| {
        let mut value = c[0];
        for k in 0..D {
            value += c[1 + k] * (3.0 * x[k] + c[4 + k]).sin() + c[7 + k] * x[k];
        }
        [size * value]
    });
    field.as_slice().to_vec()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn hidden_mismatches_have_the_derivative_of_their_value(seed in 1u64..1_000_000) {
        let grid = Grid::<2>::dyadic(3);
        let n = grid.n_nodes();
        let step = Arctan::new(0.2).unwrap();
        let other = smooth::<2>(3, seed + 1, 0.3);
        let weights: Vec<Vec<f64>> = (2..4)
            .map(|i| smooth::<2>(3, seed + i, 0.2).iter().map(|w| 0.5 + w).collect())
            .collect();
        let visibility = Visibility {
            start: Some(Interpolant::new(grid, &weights[0])),
            end: Some(Interpolant::new(grid, &weights[1])),
            sides: [[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]][(seed % 3) as usize],
        };
        let other = Interpolant::new(grid, &other).with_outside(Outside::Falling);
        let mut x = smooth::<2>(3, seed + 5, 0.3);
        for k in 0..2 {
            x.extend(smooth::<2>(3, seed + 6 + k, 0.02));
        }
        let direction = noise(3 * n, seed + 8);
        let law = StepMismatch { step, other, visibility };
        let assembly = Assembly::<_, f64, 2, 3>::new(grid, &law, Data::default());
        let mut gradient = vec![0.0; 3 * n];
        assembly.value_and_gradient_into(&x, &mut gradient).unwrap();
        check_slope(|x| assembly.value(x).unwrap(), &gradient, &x, &direction);

        let law = ComposedMismatch {
            density: HeavisideMismatch { step },
            other,
            visibility,
        };
        let coefficients = [&x[..n]];
        let data = Data { coefficients: &coefficients, cells: &[] };
        let assembly = Assembly::<_, f64, 2, 2>::new(grid, &law, data);
        let mut gradient = vec![0.0; 2 * n];
        assembly.value_and_gradient_into(&x[n..], &mut gradient).unwrap();
        check_slope(|x| assembly.value(x).unwrap(), &gradient, &x[n..], &direction[n..]);
    }

    #[test]
    fn paths_of_components_have_the_derivative_of_their_energy(seed in 1u64..1_000_000) {
        check_path::<2>(3, seed);
        check_path::<3>(2, seed);
    }
}

fn check_path<const D: usize>(level: u32, seed: u64) {
    let (steps, components) = (2, 2);
    let grid = Grid::<D>::dyadic(level);
    let params = GeodesicParams {
        mismatch_weight: 1.0,
        void_stiffness: 0.1,
        ..params(Form::LevelSets, steps)
    };
    let mut objective = LevelSetObjective::new(grid, steps, &params)
        .unwrap()
        .with_components(components)
        .with_free_ends();
    let mut x = Vec::new();
    for k in 0..=steps as u64 {
        if k > 0 {
            for i in 0..D as u64 {
                x.extend(smooth::<D>(level, seed + 10 * k + i, 0.01));
            }
        }
        for i in 0..components as u64 {
            x.extend(smooth::<D>(level, seed + 100 + 10 * k + i, 0.3));
        }
    }
    assert_eq!(x.len(), objective.dim());
    let mut gradient = vec![0.0; x.len()];
    objective.value_and_gradient(&x, &mut gradient).unwrap();
    let objective = std::cell::RefCell::new(objective);
    let value = |x: &[f64]| match objective.borrow_mut().value(x).unwrap() {
        Evaluation::Value(value) => value,
        Evaluation::Inadmissible => panic!("an admissible path"),
    };
    check_slope(value, &gradient, &x, &noise(x.len(), seed + 7));
}

#[track_caller]
fn certified<const D: usize>(found: &Geodesic<D>) {
    assert!(found.certificate.certified, "{:?}", found.certificate);
    assert!(found.length().powi(2) <= found.dissipation() * (1.0 + 1e-12));
}

#[test]
fn components_that_move_within_the_same_outline_have_a_distance() {
    // A bar of two parts, whose border moves by a tenth of the bar: the outline does not tell.
    let bar = rectangle(5, [0.5, 0.5], [0.3, 0.12]);
    let left =
        |border: f64| rectangle(5, [0.5 * (0.2 + border), 0.5], [0.5 * (border - 0.2), 0.12]);
    for form in [Form::Lagrangian, Form::LevelSets] {
        let params = params(form, 2);
        let outline = geodesic(&bar, &bar, &params, &mut Silent).unwrap();
        let [start, end] = [0.5, 0.56]
            .map(|border| Shape::of_components(vec![bar.clone(), left(border)]).unwrap());
        let both = geodesic_between(&start, &end, &params, &mut Silent).unwrap();
        certified(&both);
        assert!(both.dice_end > 0.97, "{form:?} {:?}", both.dice_components);
        assert_eq!(both.components.len(), 3);
        // One half stretched by a fifth, the other compressed by as much, in one direction: the
        // least energy of that for moduli of one is about a(1-nu^2)^-1 e^2/2 with e = .2.
        assert!(both.length() > 0.04, "{form:?} {}", both.length());
        assert!(both.length() > 8.0 * outline.length(), "{form:?}");
    }
}

#[test]
fn components_must_be_as_many_on_both_sides() {
    let bar = rectangle(4, [0.5, 0.5], [0.3, 0.12]);
    let one = Shape::new(bar.clone());
    let two = Shape::of_components(vec![bar.clone(), bar]).unwrap();
    let found = geodesic_between(&one, &two, &params(Form::Lagrangian, 1), &mut Silent);
    assert_eq!(
        found.unwrap_err(),
        GeodesicError::Components { start: 1, end: 2 }
    );
}

/// A cross with arms of this thickness, the right one of which ends there.
fn cross(thick: f64, right: f64) -> ScalarField<f64, 2> {
    from(5, move |[x, y]: [f64; 2]| {
        let bar =
            |a: f64, b: f64, low: f64, high: f64| (thick - a.abs()).min(b - low).min(high - b);
        bar(y - 0.5, x, 0.2, right).max(bar(x - 0.5, y, 0.2, 0.8))
    })
}

/// A cross whose right arm ends early, as if something stood before it.
#[test]
fn a_hidden_arm_is_restored() {
    let (template, whole, seen) = (cross(0.08, 0.8), cross(0.11, 0.8), cross(0.11, 0.62));
    let params = GeodesicParams {
        tolerance: 1e-4,
        ..params(Form::LevelSets, 4)
    };
    let run = |start: Shape<2>, end: Shape<2>| {
        let found = geodesic_between(&start, &end, &params, &mut Silent).unwrap();
        certified(&found);
        found
    };
    let reference = run(Shape::new(template.clone()), Shape::new(whole.clone()));
    // What stands before the cross is known to stand right of .6.
    let view = ScalarField::from_fn(*seen.grid(), |[x, _]| [f64::from(u8::from(x < 0.6))]);
    let partial = Shape::new(seen.clone()).with_known(Known::Within(view));
    let covered = Shape::new(seen).with_known(Known::Inside);
    let area = |u: &ScalarField<f64, 2>| levelset::mask_volume(u, 0.0);
    for (found, restored, most) in [
        (run(partial.clone(), Shape::new(template.clone())), 1, 0.1),
        (run(Shape::new(template.clone()), partial), 3, 0.1),
        // What is seen is to be covered, and more costs nothing: the boundary lags behind where the
        // template has to grow, and is free to be ahead.
        (run(Shape::new(template.clone()), covered.clone()), 3, 0.2),
        (run(covered, Shape::new(template)), 1, 0.2),
    ] {
        let change = found.length() / reference.length() - 1.0;
        assert!(change.abs() < most, "the distance changes by {change}");
        // The shape next to the hidden one has its arm.
        let shape = &found.level_sets[restored];
        assert!(shape.sample([0.76, 0.5])[0] > 0.0);
        // Its hidden part stays as thin as that of the template: nothing is known of it.
        let share = area(shape) / area(&reference.level_sets[3]);
        assert!((0.9..1.02).contains(&share), "{share}");
        assert!(found.dice_end > 0.95, "{}", found.dice_end);
    }
}

/// The same with deformations: of the cross that is visible everywhere, whichever end it is.
#[test]
fn a_hidden_arm_is_there_on_all_of_the_path() {
    let (template, seen) = (cross(0.08, 0.8), cross(0.11, 0.62));
    let view = ScalarField::from_fn(*seen.grid(), |[x, _]| [f64::from(u8::from(x < 0.6))]);
    let tip = [0.76, 0.5];
    for known in [Known::Within(view), Known::Inside] {
        let whole = Shape::new(template.clone());
        let partial = Shape::new(seen.clone()).with_known(known);
        let forced = DomainChoice::Start;
        for (start, end, domain) in [
            (&partial, &whole, Domain::End),
            (&whole, &partial, Domain::Start),
        ] {
            let params = params(Form::Lagrangian, 2);
            let found = geodesic_between(start, end, &params, &mut Silent).unwrap();
            certified(&found);
            assert_eq!(found.domain, Some(domain));
            assert!(found.level_sets.iter().all(|u| u.sample(tip)[0] > 0.0));
            assert_eq!(found.whole_end, None);
            assert!(
                !found
                    .doubts(&params)
                    .iter()
                    .any(|d| d.cause == Cause::HiddenPart)
            );
        }
        // On the domain of the other one the arm is missing at all times, and that is said.
        let params = GeodesicParams {
            domain: forced,
            ..params(Form::Lagrangian, 2)
        };
        let found = geodesic_between(&partial, &whole, &params, &mut Silent).unwrap();
        assert_eq!(found.domain, Some(Domain::Start));
        assert!(found.level_sets.iter().all(|u| u.sample(tip)[0] < 0.0));
        // The visible parts agree; of the whole, an arm of .16 x .16 is missing of .16 x (1.2 - .16).
        let lacks = found.whole_end.unwrap();
        assert!(found.dice_end > 0.97 && lacks.dice < 0.95, "{lacks:?}");
        let doubts = found.doubts(&params);
        let doubt = doubts.iter().find(|d| d.cause == Cause::HiddenPart);
        assert_eq!(doubt.unwrap().figure, lacks.dice);
    }
}

#[test]
fn shapes_that_may_both_be_hidden_anywhere_are_refused_where_no_difference_counts() {
    let [start, end] = [0.08, 0.11].map(|thick| {
        let shape = Shape::new(cross(thick, 0.8));
        shape.with_known(Known::Inside)
    });
    let run = |form, steps| geodesic_between(&start, &end, &params(form, steps), &mut Silent);
    for (form, steps) in [
        (Form::Lagrangian, 1),
        (Form::Lagrangian, 4),
        (Form::LevelSets, 1),
    ] {
        assert_eq!(
            run(form, steps).unwrap_err(),
            GeodesicError::BothHidden,
            "{form:?}"
        );
    }
    // The shape in the middle covers both.
    let found = run(Form::LevelSets, 2).unwrap();
    for end in [0, 2] {
        let pairs = found.level_sets[1].as_slice().iter();
        let missing = pairs.zip(found.level_sets[end].as_slice());
        let h = 1.0 / 32.0;
        // Up to a spacing, the width of the step of the mismatch.
        assert!(missing.filter(|(u, v)| **v > h && **u < -h).count() == 0);
    }
}
