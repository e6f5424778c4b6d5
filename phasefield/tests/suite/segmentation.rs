//! Edges of images: the energy against reference values and differences, closed forms of straight
//! edges, and that the energy falls.

use fe_grid::minimise::{Control, Iteration, Observer, Silent, Status};
use fe_grid::{Assembly, Data, Grid, ScalarField};
use phasefield::PhaseFieldError;
use phasefield::segmentation::{
    AmbrosioTortorelli, Part, Segmentation, SegmentationParams, Weights, coarser_image, relax,
    segment, split_classes,
};
use proptest::prelude::*;

use test_support::{flat, number, oracle};

fn data<'a>(coefficients: &'a [&'a [f64]]) -> Data<'a, f64> {
    Data {
        coefficients,
        cells: &[],
    }
}

fn check_oracle<const D: usize>(name: &str) {
    let Some(file) = oracle(name) else { return };
    let grid = Grid::<D>::cube(file["n"].as_u64().unwrap() as usize);
    let cases = file["cases"].as_array().unwrap();
    let mut checked = 0;
    for case in cases.iter().filter(|c| c["kind"] == "ambrosio_tortorelli") {
        let inputs = &case["inputs"];
        let law = AmbrosioTortorelli {
            weights: Weights {
                fidelity: number(inputs, "alpha"),
                smoothness: number(inputs, "beta"),
                edges: number(inputs, "nu"),
            },
            interface_width: number(inputs, "eps"),
            edge_conductance: 0.0,
        };
        let state = [flat(&inputs["u"]), flat(&inputs["v"])].concat();
        let image = flat(&inputs["u0"]);
        let coefficients = [image.as_slice()];
        let mut gradient = vec![0.0; state.len()];
        let value = Assembly::<_, f64, D, 2>::new(grid, &law, data(&coefficients))
            .value_and_gradient_into(&state, &mut gradient)
            .unwrap();
        let expected = number(case, "value");
        assert!((value - expected).abs() <= 1e-10 * expected);
        let (of_u, of_v) = gradient.split_at(grid.n_nodes());
        for (found, key) in [(of_u, "grad_u"), (of_v, "grad_v")] {
            let expected = flat(&case[key]);
            let largest = expected.iter().fold(0.0f64, |a, b| a.max(b.abs()));
            for (a, b) in found.iter().zip(&expected) {
                assert!((a - b).abs() <= 1e-10 * largest, "{key}: {a} {b}");
            }
        }
        let terms = law.terms(&grid, &image, &state).unwrap();
        assert!((terms.total - expected).abs() <= 1e-10 * expected);
        checked += 1;
    }
    assert_eq!(checked, 1);
}

#[test]
fn oracle_values_and_gradients_in_2d() {
    check_oracle::<2>("grid2d_n5.json");
}

#[test]
fn oracle_values_and_gradients_in_3d() {
    check_oracle::<3>("grid3d_n5.json");
}

fn law(width: f64) -> AmbrosioTortorelli {
    AmbrosioTortorelli {
        weights: Weights {
            fidelity: 30.0,
            smoothness: 0.7,
            edges: 1.3,
        },
        interface_width: width,
        edge_conductance: 0.01,
    }
}

/// A state with nothing special about it: `u` and `v` of size one.
fn state(n: usize, seed: u64) -> Vec<f64> {
    let wave = |i: usize| ((i as u64 * 7919 + seed * 104_729) % 1009) as f64 / 1009.0;
    (0..2 * n).map(wave).collect()
}

fn check_second_derivative<const D: usize>(cells: usize, seed: u64) {
    let grid = Grid::<D>::cube(cells + 1);
    let (law, n) = (law(0.2), grid.n_nodes());
    let (x, d, image) = (state(n, seed), state(n, seed + 1), state(n, seed + 2));
    let coefficients = [&image[..n]];
    let assembly = Assembly::<_, f64, D, 2>::new(grid, &law, data(&coefficients));
    let gradient = |t: f64| {
        let moved: Vec<f64> = x.iter().zip(&d).map(|(x, d)| x + t * d).collect();
        let mut gradient = vec![0.0; 2 * n];
        let value = assembly.value_and_gradient_into(&moved, &mut gradient);
        (value.unwrap(), gradient)
    };
    let dot = |a: &[f64]| a.iter().zip(&d).map(|(a, b)| a * b).sum::<f64>();
    let mut action = vec![0.0; 2 * n];
    assembly.hessian_action_into(&x, &d, &mut action);
    // The energy is a polynomial of degree four along a line: differences of such steps have an
    // error of t^2 times its fourth derivative, and rounding over t.
    let t = 1e-4;
    let ((above, ahead), (below, behind)) = (gradient(t), gradient(-t));
    let slope = dot(&gradient(0.0).1);
    assert!((slope - (above - below) / (2.0 * t)).abs() < 1e-6 * above);
    for ((a, b), h) in ahead.iter().zip(&behind).zip(&action) {
        let largest = action.iter().fold(0.0f64, |m, h| m.max(h.abs()));
        assert!(
            ((a - b) / (2.0 * t) - h).abs() < 1e-6 * largest,
            "{a} {b} {h}"
        );
    }
}

/// Relaxing one field lowers the energy, leaves the other alone, and ends where the derivative by
/// it is gone.
fn check_relaxation<const D: usize>(cells: usize, seed: u64, part: Part) {
    let grid = Grid::<D>::cube(cells + 1);
    let (law, n) = (law(2.0 / cells as f64), grid.n_nodes());
    let (mut x, image) = (state(n, seed), state(n, seed + 2));
    let before = x.clone();
    let coefficients = [&image[..n]];
    let first = relax(&grid, &law, data(&coefficients), &mut x, part).unwrap();
    let other = 1 - part as usize;
    assert_eq!(
        x[other * n..(other + 1) * n],
        before[other * n..(other + 1) * n]
    );
    let mut gradient = vec![0.0; 2 * n];
    let assembly = Assembly::<_, f64, D, 2>::new(grid, &law, data(&coefficients));
    let norm = |x: &[f64], gradient: &mut [f64]| {
        let energy = assembly.value_and_gradient_into(x, gradient).unwrap();
        let own = &gradient[part as usize * n..(part as usize + 1) * n];
        (energy, own.iter().map(|g| g * g).sum::<f64>().sqrt())
    };
    let (energy, start) = norm(&before, &mut gradient);
    assert_eq!(energy, first.energy);
    let (after, end) = norm(&x, &mut gradient);
    assert!(after < energy);
    // The tolerance of the systems, and rounding.
    assert!(end <= 1.01e-4 * start, "{end} {start}");
    // Multigrid makes the number of iterations small whatever the conductances.
    assert!(first.iterations <= 25, "{}", first.iterations);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn second_derivatives_agree_with_differences(seed in 0u64..1000) {
        check_second_derivative::<2>(6, seed);
        check_second_derivative::<3>(3, seed);
    }

    #[test]
    fn each_system_is_solved(seed in 0u64..1000) {
        for part in [Part::Image, Part::PhaseField] {
            check_relaxation::<2>(32, seed, part);
            check_relaxation::<3>(8, seed, part);
        }
    }
}

/// Bright where a function of the position is positive.
fn picture<const D: usize>(
    grid: Grid<D>,
    contrast: f64,
    inside: impl Fn([f64; D]) -> f64,
) -> ScalarField<f64, D> {
    let h = grid.spacing();
    ScalarField::from_fn(
        grid,
        |x| [0.5 + contrast * (inside(x) / h).clamp(-0.5, 0.5)],
    )
}

/// Even noise of this standard deviation, the same in every run.
fn noisy<const D: usize>(mut image: ScalarField<f64, D>, deviation: f64) -> ScalarField<f64, D> {
    let mut state = 1u64;
    for v in image.as_mut_slice() {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        *v += deviation * 12f64.sqrt() * ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5);
    }
    image
}

fn run<const D: usize>(
    image: &ScalarField<f64, D>,
    params: &SegmentationParams,
) -> Segmentation<D> {
    let result = segment(image, params, &mut Silent).unwrap();
    assert_eq!(result.status, Status::EnergyTolerance);
    for level in &result.levels {
        // Not even by rounding: the steps that end a level lower the energy by more than that.
        assert!(level.energies.windows(2).all(|w| w[1] <= w[0]), "{level:?}");
        let last = level.energies[level.iterations];
        assert!((level.energy.total - last).abs() < 1e-12 * last);
        // k_eps falls faster than eps.
        assert!(level.edge_conductance <= level.interface_width.powi(2) * 1.000_001);
    }
    result
}

/// An edge of height one: its length is what the energy of the phase field says, the image on
/// both sides is as it was, and the phase field is zero on it.
fn check_straight_edge<const D: usize>(cells: usize) {
    let grid = Grid::<D>::cube(cells + 1);
    let image = picture(grid, 1.0, |x| x[D - 1] - 0.5);
    let params = SegmentationParams::default();
    let result = run(&image, &params);
    // The jump takes a whole cell, all over which the phase field is zero: that adds
    // h / (4 eps) = 1/8. The rest is the discrete profile of an interface two spacings wide.
    let length = result.energy().edges / params.weights.edges;
    assert!((length - 1.125).abs() < 0.1, "{length}");
    let at = |height: f64| {
        let mut x = [0.5; D];
        x[D - 1] = height;
        (result.image.sample(x)[0], result.phase_field.sample(x)[0])
    };
    let (_, edge) = at(0.5);
    assert!(edge.abs() < 0.1, "{edge}");
    // Six interface widths away and more.
    for (height, grey) in [(0.1, 0.0), (0.9, 1.0)] {
        let (u, v) = at(height);
        assert!((u - grey).abs() < 0.01 && v > 0.93, "{u} {v}");
    }
}

#[test]
fn a_straight_edge_is_found_with_its_length() {
    check_straight_edge::<2>(64);
    check_straight_edge::<3>(32);
}

/// The contrast that is asked for separates what is an edge from what is smoothed away, up to the
/// factor that comes of an interface of finite width.
#[test]
fn contrast_decides_what_is_an_edge() {
    let grid = Grid::<2>::dyadic(6);
    let least = |jump: f64| {
        let image = picture(grid, jump, |x| x[0] - 0.5);
        let result = run(&image, &SegmentationParams::default());
        result
            .phase_field
            .as_slice()
            .iter()
            .copied()
            .fold(1.0, f64::min)
    };
    assert!(least(0.4) < 0.3, "{}", least(0.4));
    assert!(least(0.05) > 0.9, "{}", least(0.05));
}

/// A disk in noise: smoothing leaves its edge and takes the noise.
#[test]
fn a_disk_is_found_in_noise() {
    let grid = Grid::<2>::dyadic(7);
    let inside = |x: [f64; 2]| 0.27 - (x[0] - 0.52).hypot(x[1] - 0.47);
    let clean = picture(grid, 0.4, inside);
    let image = noisy(clean.clone(), 0.13);
    // The noise is below the bound l c^2 / (8 eps) of its variance, the jump above that of edges.
    let params = SegmentationParams {
        weights: Weights::for_scales(1.0, 0.04, 0.25).unwrap(),
        ..SegmentationParams::default()
    };
    let result = run(&image, &params);
    let split = |image: &ScalarField<f64, 2>| {
        let classes = split_classes(image.as_slice(), 2).unwrap();
        levelset::dice(image, classes.thresholds[0], &clean, 0.5).unwrap()
    };
    let (before, after) = (split(&image), split(&result.image));
    assert!(after > 0.98 && before < 0.95, "{before} {after}");
    // Far from the edge there is none, and the noise is gone.
    let far = |x: [f64; 2]| (result.image.sample(x)[0], result.phase_field.sample(x)[0]);
    for (x, grey) in [([0.52, 0.47], 0.7), ([0.1, 0.9], 0.3)] {
        let (u, v) = far(x);
        assert!((u - grey).abs() < 0.05 && v > 0.8, "{u} {v}");
    }
}

struct Impatient;

impl Observer for Impatient {
    fn iteration(&mut self, _: &Iteration<'_>) -> Control {
        Control::Cancel
    }
}

#[test]
fn what_makes_no_sense_is_refused_and_a_wish_to_stop_is_heard() {
    let grid = Grid::<2>::dyadic(5);
    let mut image = picture(grid, 1.0, |x| x[0] - 0.5);
    let bad = SegmentationParams {
        tolerance: 0.0,
        ..SegmentationParams::default()
    };
    assert!(matches!(
        segment(&image, &bad, &mut Silent),
        Err(PhaseFieldError::Parameter {
            name: "tolerance",
            ..
        })
    ));
    assert!(Weights::for_scales(1.0, 0.02, f64::NAN).is_err());
    let stopped = segment(&image, &SegmentationParams::default(), &mut Impatient).unwrap();
    assert_eq!(stopped.status, Status::Cancelled);
    assert_eq!(stopped.image.grid().nodes_per_axis(), [17, 17]);
    image.as_mut_slice()[7] = f64::NAN;
    assert_eq!(
        segment(&image, &SegmentationParams::default(), &mut Silent),
        Err(PhaseFieldError::NotFinite { node: 7 })
    );
}

#[test]
fn scales_give_the_default_weights_and_means_stay() {
    let params = SegmentationParams::default();
    let found = Weights::for_scales(1.0, 0.02, 0.2).unwrap();
    for (a, b) in [
        (found.fidelity, params.weights.fidelity),
        (found.smoothness, params.weights.smoothness),
        (found.edges, params.weights.edges),
    ] {
        assert!((a / b - 1.0).abs() < 1e-12);
    }
    let fine = ScalarField::<f64, 2>::from_fn(Grid::dyadic(4), |x| [2.0 + 0.0 * x[0]]);
    let coarse = coarser_image(&Grid::dyadic(3), &fine);
    assert!(coarse.as_slice().iter().all(|v| (v - 2.0).abs() < 1e-14));
}

#[test]
fn values_fall_into_their_classes() {
    let values: Vec<f64> = (0..900)
        .map(|i| [0.1, 0.5, 0.8][i % 3] + 0.01 * (i as f64).sin())
        .collect();
    let three = split_classes(&values, 3).unwrap();
    assert!((three.thresholds[0] - 0.3).abs() < 0.01, "{three:?}");
    assert!((three.thresholds[1] - 0.65).abs() < 0.01, "{three:?}");
    assert!(three.separation > 0.99);
    let two = split_classes(&values, 2).unwrap();
    assert!(
        (two.thresholds[0] - 0.3).abs() < 0.01 && two.separation < 0.95,
        "{two:?}"
    );
    assert_eq!(split_classes(&[1.0; 5], 2), None);
    assert_eq!(split_classes(&[0.0, 1.0], 3), None);
}
