//! What holds for every analysis, whatever the deformations.

use crate::support::{blob, smooth, three};
use fe_grid::minimise::Silent;
use fe_grid::pullback::Derivatives;
use fe_grid::vector::{axpy, dot, norm};
use fe_grid::vector::{max_abs, max_abs_difference};
use fe_grid::{Field, Grid, LinearOperator, VectorField};
use hyperelastic::{LameModuli, LawSpec};
use nalgebra::DMatrix;
use proptest::prelude::*;
use shape_pca::{
    Average, Compound, Finite, Metric, Pca, PcaError, PcaParams, Quality, Source, evaluate,
    object_product,
};
use test_support::on_threads;

fn analysed<const D: usize>(average: &Average<D>, params: &PcaParams) -> (Compound<D>, Pca<D>) {
    let compound = Compound::new(average, params).unwrap();
    let pca = Pca::new(average, &compound, usize::MAX, &mut Silent).unwrap();
    (compound, pca)
}

fn wave(n: usize, seed: usize) -> Vec<f64> {
    (0..n)
        .map(|i| ((i * 7919 + seed * 104_729) % 1013) as f64 / 506.0 - 1.0)
        .collect()
}

/// Value, gradient and Hessian of the composed energy against differences.
fn check_derivatives<const D: usize>(grid: Grid<D>, law: &str) {
    let law = LawSpec::new(law, LameModuli::default())
        .unwrap()
        .compile()
        .unwrap();
    let average = three(grid);
    let sources = average.sources();
    let at =
        |w: &[f64], derivatives| evaluate(&grid, &law, 1e-2, &sources, w, derivatives).unwrap();
    let state = smooth(grid, 0.01, 0.7).into_vec();
    let direction = smooth(grid, 1.0, 2.1).into_vec();
    let found = at(&state, Derivatives::Hessian);
    let t = 1e-5;
    let moved = |t: f64| {
        let mut w = state.clone();
        axpy(t, &direction, &mut w);
        w
    };
    let (up, down) = (
        at(&moved(t), Derivatives::Gradient),
        at(&moved(-t), Derivatives::Gradient),
    );
    let slope = (up.value - down.value) / (2.0 * t);
    let expected = dot(&found.gradient, &direction);
    // Differences of second order with a step of 1e-5: errors of t^2 and of rounding over t.
    assert!(
        (slope - expected).abs() < 1e-7 * expected.abs().max(1.0),
        "{slope} {expected}"
    );
    let mut product = vec![0.0; direction.len()];
    found
        .hessian
        .unwrap()
        .0
        .apply_into(&direction, &mut product);
    let mut change = up.gradient;
    axpy(-1.0, &down.gradient, &mut change);
    let change: Vec<f64> = change.iter().map(|x| x / (2.0 * t)).collect();
    assert!(max_abs_difference(&change, &product) < 1e-7 * max_abs(&product));
    // The value alone is the same to the last bit.
    assert_eq!(at(&state, Derivatives::Value).value, found.value);
}

#[test]
fn derivatives_are_those_of_the_energy() {
    check_derivatives::<2>(Grid::dyadic(3), "logdet");
    check_derivatives::<2>(Grid::dyadic(3), "inverse:power");
    check_derivatives::<3>(Grid::dyadic(2), "power");
}

#[test]
fn a_fold_is_told_and_no_panic() {
    let grid = Grid::<2>::dyadic(3);
    let average = three(grid);
    let law = LawSpec::default().compile().unwrap();
    // A mirror image.
    let mirrored = Field::<f64, 2, 2>::from_fn(grid, |x| [-2.0 * x[0], 0.0]).into_vec();
    let found = evaluate(
        &grid,
        &law,
        1e-4,
        &average.sources(),
        &mirrored,
        Derivatives::Value,
    );
    assert!(matches!(
        found,
        Err(PcaError::Grid(fe_grid::GridError::Inadmissible { .. }))
    ));
}

proptest! {
    // Each case assembles an operator: a few are enough for identities that hold exactly.
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn the_operator_is_symmetric_and_the_load_free_of_force_and_moment(
        seed in 0usize..1000, phase in 0.0..6.0f64,
    ) {
        let grid = Grid::<2>::dyadic(4);
        let displacement = smooth(grid, 0.03, phase);
        let chi = blob(grid, 0.3);
        let source = Source {
            weight: 1.0,
            displacement: displacement.as_slice(),
            indicator: chi.as_slice(),
        };
        let law = LawSpec::default().compile().unwrap();
        let found = evaluate(&grid, &law, 1e-4, &[source], &[], Derivatives::Hessian).unwrap();
        let (matrix, _) = found.hessian.unwrap();
        let (u, v) = (wave(matrix.dim(), seed), wave(matrix.dim(), seed + 1));
        let product = |x: &[f64]| {
            let mut y = vec![0.0; x.len()];
            matrix.apply_into(x, &mut y);
            y
        };
        let (a, b) = (dot(&v, &product(&u)), dot(&u, &product(&v)));
        // Rounding of sums of a few thousand products.
        prop_assert!((a - b).abs() < 1e-11 * norm(&product(&u)) * norm(&v));
        let average = three(grid);
        let rigid = shape_pca::RigidMotions::new(average.object()).unwrap();
        for motion in rigid.motions() {
            // A Cauchy stress is symmetric: it does no work on a rigid motion.
            prop_assert!(dot(motion, &found.gradient).abs() < 1e-13);
        }
        // Nor does a translation cost anything.
        for motion in &rigid.motions()[..2] {
            prop_assert!(norm(&product(motion)) < 1e-11 * norm(&product(&u)));
        }
    }

    #[test]
    fn scores_know_nothing_of_rigid_motions(
        shift in prop::array::uniform2(-0.5..0.5f64), turn in -1.0..1.0f64,
    ) {
        let grid = Grid::<2>::dyadic(4);
        let average = three(grid);
        let (compound, pca) = analysed(&average, &PcaParams::default());
        let load = compound.load(average.source(0)).unwrap();
        let (u, _) = compound.respond(&load).unwrap();
        // A load of forces and moments on the object has no response, whatever its size.
        let mut moved = load.clone();
        let motion = Field::<f64, 2, 2>::from_fn(grid, |[x, y]| {
            [shift[0] - turn * (y - 0.4), shift[1] + turn * (x - 0.3)]
        });
        axpy(1e-2, &object_product(&pca.space.object, motion.as_slice()), &mut moved);
        let (same, _) = compound.respond(&moved).unwrap();
        prop_assert!(max_abs_difference(&u, &same) < 1e-6 * max_abs(&u));
        prop_assert!(compound.rigid().violation(&pca.space.object, &u) < 1e-12);
    }
}

/// What must hold of a result.
fn check<const D: usize>(average: &Average<D>, params: &PcaParams) {
    let (compound, pca) = analysed(average, params);
    let n = average.n_shapes() as f64;
    assert!(pca.definite(), "{}", pca.least_curvature);
    assert_eq!(pca.modes.rank(), average.n_shapes() - 1);
    // The linear problem is solved: what is left is a reaction of the constraints.
    for (u, i) in pca.displacements.iter().zip(0..) {
        let mut residual = compound.load(average.source(i)).unwrap();
        let mut whole = u.as_slice().to_vec();
        axpy(1.0, pca.space.mean.as_slice(), &mut whole);
        let size = norm(&residual);
        axpy(-1.0, &compound.apply(&whole), &mut residual);
        compound.rigid().balance(&mut residual);
        assert!(norm(&residual) < 2.0 * params.tolerance * size);
        assert!(compound.rigid().violation(&pca.space.object, u.as_slice()) < 1e-10);
    }
    // Centred.
    let mut mean = vec![0.0; pca.space.mean.as_slice().len()];
    for (u, weight) in pca.displacements.iter().zip(average.weights()) {
        axpy(*weight, u.as_slice(), &mut mean);
    }
    assert!(max_abs(&mean) < 1e-14);
    // Modes are orthonormal.
    for (i, y) in pca.space.fields.iter().enumerate() {
        let scores = pca.space.scores(&compound, y);
        for (j, score) in scores.scores.iter().enumerate() {
            let product = score * pca.modes.eigenvalues[j].sqrt();
            let expected = f64::from(u8::from(i == j));
            assert!((product - expected).abs() < 1e-8, "{i} {j} {product}");
        }
    }
    // All modes together give the training shapes back.
    let mut square = 0.0;
    for ((scores, u), weight) in pca
        .training
        .iter()
        .zip(&pca.displacements)
        .zip(average.weights())
    {
        let made = pca.space.synthesise(&scores.scores).unwrap();
        assert!(max_abs_difference(made.as_slice(), u.as_slice()) < 1e-8 * max_abs(u.as_slice()));
        square += weight * scores.mahalanobis.over_n.powi(2);
        assert!(scores.residual() < 1e-6);
    }
    assert!((square.sqrt() - ((n - 1.0) / n).sqrt()).abs() < 1e-8);
}

#[test]
fn modes_are_what_they_should_be() {
    let params = PcaParams::default();
    let hessian = PcaParams {
        metric: Metric::Hessian,
        ..params
    };
    let at_rest = PcaParams {
        at_rest: true,
        ..params
    };
    let average = three(Grid::<2>::dyadic(4));
    let deformed_void = PcaParams {
        void_at_rest: false,
        ..params
    };
    for params in [params, hessian, at_rest, deformed_void] {
        check(&average, &params);
    }
    let displacements = average.displacements().to_vec();
    let indicators = [0.25, 0.28, 0.3].map(|radius| blob(*average.grid(), radius));
    let weights = vec![0.2, 0.5, 0.3];
    check(
        &Average::new(displacements, indicators.into(), weights).unwrap(),
        &params,
    );
    check(&three(Grid::<3>::dyadic(3)), &params);
}

#[test]
fn threads_do_not_matter() {
    let average = three(Grid::<3>::dyadic(4));
    let run = |n| on_threads(n, || analysed(&average, &PcaParams::default()).1);
    let (one, three) = (run(1), run(3));
    assert_eq!(one.space.fields, three.space.fields);
    assert_eq!(one.modes, three.modes);
}

/// `|u_delta - u|` falls like `delta`.
#[test]
fn the_linear_response_is_the_limit_of_small_loads() {
    let grid = Grid::<2>::dyadic(4);
    let average = three(grid);
    let compound = Compound::new(&average, &PcaParams::default()).unwrap();
    let load = compound.load(average.source(0)).unwrap();
    let (u, _) = compound.respond(&load).unwrap();
    let finite = Finite::new(&average, &compound);
    let error = |delta: f64| {
        let small: Vec<f64> = load.iter().map(|f| delta * f).collect();
        let (w, report) = finite.respond(&small, &mut Silent).unwrap();
        assert_eq!(report.share, 1.0);
        let scaled: Vec<f64> = w.as_slice().iter().map(|w| w / delta).collect();
        let difference: Vec<f64> = scaled.iter().zip(&u).map(|(a, b)| a - b).collect();
        let on_object = |x: &[f64]| dot(x, &object_product(average.object(), x)).sqrt();
        on_object(&difference) / on_object(&u)
    };
    let errors: Vec<f64> = [0.2, 0.1, 0.05, 0.025].map(error).into();
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        // First order, up to the next term of the expansion.
        assert!((order - 1.0).abs() < 0.15, "{errors:?}");
    }
    println!("{errors:?}");
}

#[test]
fn quality_is_measured() {
    let grid = Grid::<2>::dyadic(4);
    // Shapes of two modes: the third that is left out is made of the others but for its size.
    let phases = [0.0, 0.4, 1.3, 2.0, 2.9];
    let displacements: Vec<VectorField<f64, 2>> = phases
        .iter()
        .map(|phase| smooth(grid, 0.03, *phase))
        .collect();
    let indicators = vec![blob(grid, 0.3); 5];
    let average = Average::new(displacements, indicators, vec![0.2; 5]).unwrap();
    let (_, pca) = analysed(&average, &PcaParams::default());
    let quality = Quality::new(&pca.gram, &[0.2; 5], 1e-10, usize::MAX).unwrap();
    assert_eq!((quality.left_out.len(), quality.compactness.len()), (5, 4));
    assert!((quality.compactness[3] - 1.0).abs() < 1e-12);
    assert!(quality.generalisation.windows(2).all(|e| e[1] <= e[0]));
    assert_eq!(quality.generalisation.len(), 4);
    // Without modes a shape is as far from the mean of the others as n/(n-1) times its own part.
    let spread: f64 = (0..5).map(|i| pca.gram[(i, i)]).sum::<f64>() / 5.0;
    assert!((quality.generalisation[0] - 1.25 * spread.sqrt()).abs() < 1e-12);
    assert!(quality.specificity.iter().all(|s| *s > 0.0));
    // Of three shapes two are equal: without the third there are no modes, and it is as far from them as they are.
    let equal = [0, 0, 1].map(|i| [0, 0, 1].map(|j| pca.gram[(i, j)]));
    let gram = DMatrix::from_fn(3, 3, |i, j| equal[i][j]);
    let quality = Quality::new(&gram, &[1.0 / 3.0; 3], 1e-10, usize::MAX).unwrap();
    let third = &quality.left_out[2];
    let distance = (gram[(0, 0)] - 2.0 * gram[(0, 2)] + gram[(2, 2)]).sqrt();
    assert!(third.scores.is_empty() && third.mahalanobis.p_value == 1.0);
    assert!((third.norm / distance - 1.0).abs() < 1e-12);
}

#[test]
fn what_cannot_be_analysed_is_refused() {
    let grid = Grid::<2>::dyadic(3);
    let (u, chi) = (smooth(grid, 0.02, 0.0), blob(grid, 0.3));
    let one = Average::new(vec![u.clone()], vec![chi.clone()], vec![1.0]);
    assert!(matches!(one, Err(PcaError::TooFewShapes { found: 1 })));
    let missing = Average::new(vec![u.clone(); 2], vec![chi.clone()], vec![0.5; 2]);
    assert!(matches!(missing, Err(PcaError::Fields { index: 1, .. })));
    let heavy = Average::new(vec![u.clone(); 2], vec![chi.clone(); 2], vec![0.5, 0.7]);
    assert!(matches!(heavy, Err(PcaError::Weights { .. })));
    let mut broken = u.clone();
    broken.as_mut_slice()[7] = f64::NAN;
    let broken = Average::new(vec![u.clone(), broken], vec![chi.clone(); 2], vec![0.5; 2]);
    assert!(matches!(broken, Err(PcaError::NotFinite { index: 1, .. })));
    let same = Average::new(vec![u; 2], vec![chi; 2], vec![0.5; 2]).unwrap();
    let compound = Compound::new(&same, &PcaParams::default()).unwrap();
    let nothing = Pca::new(&same, &compound, 9, &mut Silent);
    assert!(matches!(nothing, Err(PcaError::NoVariation)));
    let load = vec![f64::NAN; 2 * grid.n_nodes()];
    assert!(compound.respond(&load).is_err());
    let at_rest = vec![0.0; load.len()];
    let (_, report) = Finite::new(&same, &compound)
        .respond(&at_rest, &mut Silent)
        .unwrap();
    assert_eq!(report.share, 1.0);
}

/// Energies are proportional to the moduli, whose unit is free: a power of two changes exponents and no other
/// bit of any number, so that variances by the energy are multiplied by it, and nothing else changes.
#[test]
fn modes_have_no_unit() {
    fn check<const D: usize>(grid: Grid<D>) {
        let average = three(grid);
        let scaled = |metric: Metric, factor: f64| {
            let moduli = LameModuli::new(factor, factor).unwrap();
            let params = PcaParams {
                metric,
                law: LawSpec {
                    moduli,
                    ..LawSpec::default()
                },
                ..PcaParams::default()
            };
            analysed(&average, &params).1
        };
        for metric in [Metric::L2, Metric::Hessian] {
            let one = scaled(metric, 1.0);
            for power in [-20, 20] {
                let factor = 2.0f64.powi(power);
                let other = scaled(metric, factor);
                let unit = if metric == Metric::Hessian {
                    factor
                } else {
                    1.0
                };
                let variances = one.modes.eigenvalues.iter().map(|v| unit * v);
                assert_eq!(other.modes.eigenvalues, variances.collect::<Vec<_>>());
                assert_eq!(other.modes.compactness(), one.modes.compactness());
            }
        }
    }
    check(Grid::<2>::dyadic(4));
    check(Grid::<3>::dyadic(3));
}
