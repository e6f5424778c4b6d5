//! Properties of every average, and what happens when it cannot be had.

use crate::support::run;
use crate::support::shapes::{ball, bar, ellipsoid};
use fe_grid::minimise::{Control, Evaluation, Iteration, Objective, Observer, Silent, Status};
use fe_grid::vector::{max_abs, max_abs_difference};
use fe_grid::{Field, Grid, ScalarField};
use hyperelastic::LameModuli;
use levelset::dice;
use shape_average::{
    AverageError, AverageObjective, AverageParams, AverageResult, BoundaryCondition, LevelShapes,
    Solver, average,
};
use test_support::on_threads;

fn three_shapes() -> [ScalarField<f64, 2>; 3] {
    let grid = Grid::dyadic(5);
    [
        bar(grid, 180.0, 0.0),
        bar(grid, 130.0, 0.2),
        ellipsoid(grid, [0.3, 0.1], -0.1),
    ]
}

/// Sums over shapes are taken in their order, so that another order gives other rounding, which
/// the minimiser carries on: far less than its own tolerance.
#[test]
fn the_order_of_the_shapes_does_not_matter() {
    let [a, b, c] = three_shapes();
    let params = AverageParams::default();
    let first = run(&[a.clone(), b.clone(), c.clone()], &params);
    let second = run(&[c, a, b], &params);
    let (v, w) = (first.average.as_slice(), second.average.as_slice());
    assert!(max_abs_difference(v, w) < 1e-6);
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let (u, w) = (&first.displacements[i], &second.displacements[j]);
        assert!(max_abs_difference(u.as_slice(), w.as_slice()) < 1e-6);
        let (e, f) = (first.energy.elastic[i], second.energy.elastic[j]);
        assert!((e - f).abs() < 1e-6 * e);
    }
}

/// The first shape is much stiffer than the others: it stays, and they come to it.
#[test]
fn nearly_all_weight_on_one_shape_returns_it() {
    let shapes = three_shapes();
    let params = AverageParams {
        weights: Some(vec![0.98, 0.01, 0.01]),
        ..AverageParams::default()
    };
    let result = run(&shapes, &params);
    let overlap = dice(&result.average_indicator, 0.5, &shapes[0], 0.0).unwrap();
    assert!(overlap > 0.98, "{overlap}");
    let elastic = &result.energy.elastic;
    assert!(
        100.0 * elastic[0] < elastic[1].min(elastic[2]),
        "{elastic:?}"
    );
}

fn all_bits<const D: usize>(result: &AverageResult<D>) -> Vec<u64> {
    let mut numbers = result.average.as_slice().to_vec();
    numbers.extend_from_slice(result.average_indicator.as_slice());
    for (u, pushed) in result.displacements.iter().zip(&result.pushed) {
        numbers.extend_from_slice(u.as_slice());
        numbers.extend_from_slice(pushed.as_slice());
    }
    for level in &result.levels {
        numbers.extend_from_slice(&level.energies);
        numbers.extend_from_slice(&level.energy.elastic);
    }
    numbers.push(result.certificate.min_det);
    numbers.extend_from_slice(&result.dice);
    numbers.iter().map(|x| x.to_bits()).collect()
}

fn check_bits<const D: usize>(shapes: &[ScalarField<f64, D>], solver: Solver) {
    let params = AverageParams {
        solver,
        // Enough to go through every part of the program; on all levels.
        max_iterations: 6,
        ..AverageParams::default()
    };
    let on = |threads| on_threads(threads, || all_bits(&run(shapes, &params)));
    assert!(on(1) == on(3), "three threads give other bits");
}

/// Grids that are large enough for every part to be spread over threads.
#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let grid = Grid::<2>::dyadic(7);
    let shapes = [bar(grid, 180.0, 0.0), bar(grid, 130.0, 0.2)];
    check_bits(&shapes, Solver::Lbfgs);
    let coarse = Grid::<2>::dyadic(5);
    let shapes = [bar(coarse, 180.0, 0.0), bar(coarse, 130.0, 0.2)];
    check_bits(&shapes, Solver::Descent);
    let grid = Grid::<3>::dyadic(5);
    let shapes = [
        ellipsoid(grid, [0.3, 0.15, 0.2], 0.0),
        ellipsoid(grid, [0.2, 0.25, 0.15], 0.3),
    ];
    check_bits(&shapes, Solver::Lbfgs);
}

/// A smooth displacement that is not symmetric in any way.
fn smooth<const D: usize>(grid: Grid<D>, amplitude: f64, phase: f64) -> Vec<f64> {
    let u = Field::<f64, D, D>::from_fn(grid, |x| {
        std::array::from_fn(|m| {
            let wave = |k: usize| (3.0 * x[k] + phase * (1.0 + m as f64) + k as f64).sin();
            amplitude * (0..D).map(wave).product::<f64>()
        })
    });
    u.into_vec()
}

/// The gradient leaves out how the average changes with the deformations: its derivative there
/// is zero. Central differences of a step that moves hardly any quadrature point into another
/// cell of the average, where its slope jumps.
fn check_gradient<const D: usize>(shapes: &[ScalarField<f64, D>], params: &AverageParams) {
    let grid = *shapes[0].grid();
    let level = LevelShapes::new(grid, shapes, params).unwrap();
    let start = vec![1.0; grid.n_nodes()];
    let mut objective = AverageObjective::new(level, params, start).unwrap();
    let x = [smooth(grid, 0.03, 0.4), smooth(grid, 0.04, 1.3)].concat();
    let mut gradient = vec![0.0; x.len()];
    let value = |e: Evaluation| match e {
        Evaluation::Value(value) => value,
        Evaluation::Inadmissible => panic!("an admissible state"),
    };
    value(objective.value_and_gradient(&x, &mut gradient).unwrap());
    for phase in [0.0, 2.0] {
        let direction = [smooth(grid, 1.0, phase), smooth(grid, -1.0, phase + 0.7)].concat();
        let t = 1e-6;
        let mut energy_at = |t: f64| {
            let moved: Vec<f64> = x.iter().zip(&direction).map(|(x, d)| x + t * d).collect();
            value(objective.value(&moved).unwrap())
        };
        let difference = (energy_at(t) - energy_at(-t)) / (2.0 * t);
        let slope: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
        assert!(
            (difference - slope).abs() < 1e-6 * slope.abs(),
            "{difference} {slope}"
        );
    }
}

#[test]
fn the_gradient_is_that_of_the_reduced_functional() {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [bar(grid, 180.0, 0.0), bar(grid, 130.0, 0.2)];
    for law in ["logdet", "power", "inverse:logdet"] {
        let mut params = AverageParams {
            weights: Some(vec![0.3, 0.7]),
            length_weight: Some(0.1),
            void_stiffness: 0.01,
            ..AverageParams::default()
        };
        params.law.law = law.parse().unwrap();
        check_gradient(&shapes, &params);
    }
    let grid = Grid::<3>::dyadic(3);
    let shapes = [0.2, 0.3].map(|radius| ball(grid, [0.45, 0.5, 0.55], radius));
    check_gradient(&shapes, &AverageParams::default());
}

/// Both solvers minimise the same functional. What the slow one has left after a few hundred
/// iterations is a small part of what it has gained.
#[test]
fn both_solvers_reach_the_same_energy() {
    let [a, b, _] = three_shapes();
    let shapes = [a, b];
    let energy = |solver, max_iterations| {
        let params = AverageParams {
            solver,
            max_iterations,
            tolerance: 2e-3,
            ..AverageParams::default()
        };
        run(&shapes, &params)
    };
    let fast = energy(Solver::Lbfgs, 100);
    let slow = energy(Solver::Descent, 400);
    assert!((fast.energy.total - slow.energy.total).abs() < 1e-3 * fast.energy.total);
    assert!(fast.energy.total < slow.energy.total + 1e-5);
}

#[test]
fn a_boundary_can_be_held() {
    let [a, b, _] = three_shapes();
    for solver in [Solver::Lbfgs, Solver::Descent] {
        let params = AverageParams {
            boundary: BoundaryCondition::Identity,
            solver,
            max_iterations: 20,
            ..AverageParams::default()
        };
        let result = run(&[a.clone(), b.clone()], &params);
        let grid = *result.average.grid();
        let n = grid.nodes_per_axis();
        for u in &result.displacements {
            assert!(max_abs(u.as_slice()) > 0.01);
            for i in 0..grid.n_nodes() {
                let node = grid.node(i);
                if (0..2).any(|k| node[k] == 0 || node[k] + 1 == n[k]) {
                    assert_eq!(u.at(i), [0.0; 2]);
                }
            }
        }
    }
}

/// Cancels in an iteration of a level.
struct Impatient {
    level: usize,
    iteration: usize,
    now: usize,
    levels_visible: usize,
}

impl Observer for Impatient {
    fn level(&mut self, level: usize, n_levels: usize, dim: usize) {
        assert!(level < n_levels && dim > 0);
        self.now = level;
        self.levels_visible += 1;
    }

    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        if self.now == self.level && iteration.iteration == self.iteration {
            Control::Cancel
        } else {
            Control::Continue
        }
    }
}

#[test]
fn a_cancelled_average_is_what_was_reached() {
    let shapes = three_shapes();
    for solver in [Solver::Lbfgs, Solver::Descent] {
        for (level, iteration) in [(0, 0), (1, 2), (2, 1)] {
            let mut observer = Impatient {
                level,
                iteration,
                now: 0,
                levels_visible: 0,
            };
            let params = AverageParams {
                solver,
                ..AverageParams::default()
            };
            let result = average(&shapes, &params, &mut observer).unwrap();
            assert_eq!(result.status, Status::Cancelled);
            assert_eq!(observer.levels_visible, level + 1);
            assert_eq!(result.levels.len(), level + 1);
            assert_eq!(result.levels[level].iterations, iteration);
            let grid = Grid::<2>::dyadic(3 + level as u32);
            assert_eq!(result.average.grid(), &grid);
            assert_eq!(result.displacements[2].grid(), &grid);
            assert!(result.certificate.certified);
        }
    }
}

fn refused(shapes: &[ScalarField<f64, 2>], params: &AverageParams) -> AverageError {
    average(shapes, params, &mut Silent).expect_err("an error")
}

#[test]
fn bad_shapes_are_named() {
    let params = AverageParams::default();
    let [a, b, _] = three_shapes();
    assert_eq!(refused(&[], &params), AverageError::NoShapes);
    let other = ball(Grid::dyadic(4), [0.5; 2], 0.2);
    assert_eq!(
        refused(&[a.clone(), b.clone(), other], &params),
        AverageError::GridsDiffer { index: 2 }
    );
    // What is no number is refused.
    let mut broken = b.clone();
    broken.as_mut_slice()[100] = f64::NAN;
    let _: AverageError = refused(&[a.clone(), broken], &params);
    for (value, what) in [(-1.0, "empty"), (1.0, "full")] {
        let constant = ScalarField::from_fn(*a.grid(), |_| [value]);
        assert_eq!(
            refused(&[a.clone(), constant], &params),
            AverageError::Degenerate { index: 1, what }
        );
    }
    let mut mask = b.clone();
    for u in mask.as_mut_slice() {
        *u = f64::from(u8::from(*u > 0.0));
    }
    assert_eq!(
        refused(&[a, mask], &params),
        AverageError::Mask { index: 1 }
    );
}

#[test]
fn bad_parameters_are_named() {
    let [a, b, _] = three_shapes();
    let shapes = [a, b];
    let parameter = |change: &dyn Fn(&mut AverageParams, f64), value: f64| {
        let mut params = AverageParams::default();
        change(&mut params, value);
        match refused(&shapes, &params) {
            AverageError::Parameter { name, .. } => name,
            other => panic!("{other:?}"),
        }
    };
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(
            parameter(&|p, x| p.mismatch_weight = x, bad),
            "mismatch_weight"
        );
        assert_eq!(
            parameter(&|p, x| p.length_weight = Some(x), bad),
            "length_weight"
        );
        assert_eq!(
            parameter(&|p, x| p.void_stiffness = x, bad),
            "void_stiffness"
        );
        assert_eq!(
            parameter(&|p, x| p.interface_cells = x, bad),
            "interface_cells"
        );
        assert_eq!(parameter(&|p, x| p.tolerance = x, bad), "tolerance");
        assert_eq!(
            parameter(&|p, x| p.min_determinant = x, bad),
            "min_determinant"
        );
        assert_eq!(parameter(&|p, x| p.filter_width = x, bad), "filter_width");
    }
    assert_eq!(
        parameter(&|p, x| p.void_stiffness = x, 1.5),
        "void_stiffness"
    );
    assert_eq!(
        parameter(&|p, x| p.min_determinant = x, 1.0),
        "min_determinant"
    );
    for weights in [
        vec![1.0],
        vec![0.5, 0.6],
        vec![1.5, -0.5],
        vec![f64::NAN, 1.0],
    ] {
        let params = AverageParams {
            weights: Some(weights),
            ..AverageParams::default()
        };
        assert!(matches!(
            refused(&shapes, &params),
            AverageError::Weights { expected: 2, .. }
        ));
    }
    let mut params = AverageParams::default();
    params.law.moduli = LameModuli {
        lambda: 1.0,
        mu: -1.0,
    };
    assert!(matches!(refused(&shapes, &params), AverageError::Law(_)));
}
