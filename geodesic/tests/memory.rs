//! The estimate of the memory of a path against what is asked of the allocator.

use fe_grid::minimise::Silent;
use fe_grid::{Field, Grid, ScalarField};
use geodesic::boundary_metric::{self, MetricParams, Variation};
use geodesic::calculus::{self, CalculusParams, Ladder, exponential, transport};
use geodesic::{
    DomainChoice, Form, GeodesicParams, Shape, geodesic_between, memory_estimate,
    memory_estimate_of_stability, stable_path,
};
use peak_alloc::PeakAlloc;
use test_support::{in_own_process, on_threads};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Balls beside each other, as components of a shape.
fn balls<const D: usize>(grid: Grid<D>, radius: f64, n_components: usize) -> Shape<D> {
    let ball = |i: usize| {
        let middle = (i + 1) as f64 / (n_components + 1) as f64;
        ScalarField::from_fn(grid, |x| {
            let part = |k: usize| (x[k] - if k == 0 { middle } else { 0.5 }).powi(2);
            [radius / n_components as f64 - (0..D).map(part).sum::<f64>().sqrt()]
        })
    };
    Shape::of_components((0..n_components).map(ball).collect()).unwrap()
}

/// The estimate of a path on one thread, over the most memory in use.
fn measured<const D: usize>(nodes: usize, n_components: usize, params: &GeodesicParams) -> f64 {
    on_threads(1, || {
        let before = ALLOCATOR.current_usage();
        let grid = Grid::<D>::cube(nodes);
        let [start, end] = [0.2, 0.23].map(|radius| balls(grid, radius, n_components));
        ALLOCATOR.reset_peak_usage();
        geodesic_between(&start, &end, params, &mut Silent).unwrap();
        let most = ALLOCATOR.peak_usage() - before;
        memory_estimate(params, n_components, &grid) as f64 / most as f64
    })
}

fn check<const D: usize>(nodes: usize, n_components: usize, params: &GeodesicParams) {
    let ratio = measured::<D>(nodes, n_components, params);
    let (form, steps) = (params.form, params.steps);
    println!("{D}D, {form:?}, {steps} steps, {n_components} at {nodes}: {ratio:.3}");
    // What is not counted is small; preimages depend on the shapes.
    assert!(
        (0.9..1.1).contains(&ratio),
        "{D}D {form:?} {steps} steps, {n_components} components at {nodes}: {ratio}"
    );
}

/// As many iterations as pairs are kept, and some.
fn short(form: Form, steps: usize) -> GeodesicParams {
    GeodesicParams {
        form,
        domain: DomainChoice::Ends,
        steps,
        max_iterations: Some(12),
        ..GeodesicParams::default()
    }
}

/// On the domain of a shape between both.
fn between(steps: usize) -> GeodesicParams {
    GeodesicParams {
        domain: DomainChoice::Middle,
        ..short(Form::Lagrangian, steps)
    }
}

#[test]
fn estimates_are_what_is_used() {
    in_own_process("estimates_are_what_is_used", || {
        for steps in [1, 4] {
            check::<2>(65, 1, &short(Form::Lagrangian, steps));
        }
        check::<2>(65, 3, &short(Form::Lagrangian, 3));
        check::<2>(65, 2, &short(Form::LevelSets, 3));
        check::<2>(65, 1, &between(4));
    });
}

#[test]
fn estimates_in_space_are_what_is_used() {
    in_own_process("estimates_in_space_are_what_is_used", || {
        check::<3>(33, 1, &short(Form::Lagrangian, 2));
        check::<3>(33, 1, &between(2));
    });
}

/// The estimate of the search for the least curvature of a path on one thread, over the most memory in use.
fn measured_stability<const D: usize>(nodes: usize, steps: usize) -> f64 {
    on_threads(1, || {
        let params = short(Form::Lagrangian, steps);
        let grid = Grid::<D>::cube(nodes);
        let [start, end] = [0.2, 0.23].map(|radius| balls(grid, radius, 1));
        let path = geodesic_between(&start, &end, &params, &mut Silent).unwrap();
        let before = ALLOCATOR.current_usage();
        ALLOCATOR.reset_peak_usage();
        let found = stable_path(&start, &end, path, &params, &mut Silent).unwrap();
        assert_eq!(found.saddles, 0);
        let most = ALLOCATOR.peak_usage() - before;
        memory_estimate_of_stability(&params, 1, &grid) as f64 / most as f64
    })
}

#[test]
fn estimates_of_stability_are_what_is_used() {
    in_own_process("estimates_of_stability_are_what_is_used", || {
        for (d, ratio) in [
            (2, measured_stability::<2>(65, 1)),
            (2, measured_stability::<2>(65, 4)),
            (3, measured_stability::<3>(21, 2)),
        ] {
            println!("{d}D: {ratio:.3}");
            assert!((0.9..1.1).contains(&ratio), "{d}D: {ratio}");
        }
    });
}

/// The estimate of an extension of a path of growing shapes by so many steps, or of a transport along it, over the
/// most memory in use.
fn measured_calculus<const D: usize>(nodes: usize, given: usize, steps: Option<usize>) -> f64 {
    on_threads(1, || {
        let before = ALLOCATOR.current_usage();
        let grid = Grid::<D>::cube(nodes);
        let ball = ScalarField::from_fn(grid, |x| {
            let square = |k: usize| (x[k] - 0.5).powi(2);
            [0.2 - (0..D).map(square).sum::<f64>().sqrt()]
        });
        let growth = |k: usize| {
            let share = 0.02 * (k + 1) as f64;
            Field::from_fn(grid, move |x: [f64; D]| {
                let bend = 0.02 * share * (9.0 * x[0]).sin();
                x.map(|x| share * (x - 0.5) + bend)
            })
        };
        let path: Vec<_> = (0..given).map(growth).collect();
        // More iterations than are remembered.
        let params = CalculusParams {
            tolerance: 1e-6,
            max_iterations: 60,
            history: 3,
            ..CalculusParams::default()
        };
        ALLOCATOR.reset_peak_usage();
        let variation = Field::from_fn(grid, |x: [f64; D]| x.map(|x| 0.05 * (x - 0.5)));
        if let Some(steps) = steps {
            let found = exponential(&ball, &path, steps, &params, &mut Silent).unwrap();
            assert_eq!(found.step_energies.len(), steps);
        } else {
            let ladder = Ladder::default();
            let silent = &mut Silent;
            let found = transport(&ball, &path, &variation, ladder, &params, silent).unwrap();
            assert!(found.variation.is_some(), "{:?}", found.reports);
        }
        let most = ALLOCATOR.peak_usage() - before;
        let found = steps.unwrap_or(0);
        calculus::memory_estimate(&params, given, found, &grid) as f64 / most as f64
    })
}

/// The estimate of the metric at a ball, over the most memory in use.
fn measured_metric<const D: usize>(nodes: usize) -> f64 {
    on_threads(1, || {
        let before = ALLOCATOR.current_usage();
        let ball = ScalarField::<f64, D>::from_fn(Grid::cube(nodes), |x| {
            let square = |k: usize| (x[k] - 0.5).powi(2);
            [0.3 - (0..D).map(square).sum::<f64>().sqrt()]
        });
        let variation = Variation::Nodal(ball.clone());
        let params = MetricParams::default();
        ALLOCATOR.reset_peak_usage();
        boundary_metric::estimate(&ball, &variation, &params, &mut Silent).unwrap();
        let most = ALLOCATOR.peak_usage() - before;
        boundary_metric::memory_estimate(&ball) as f64 / most as f64
    })
}

#[test]
fn estimates_of_the_calculus_and_of_the_metric_are_what_is_used() {
    in_own_process(
        "estimates_of_the_calculus_and_of_the_metric_are_what_is_used",
        || {
            let ratios = [
                ("metric, 2D", measured_metric::<2>(65)),
                ("metric, 3D", measured_metric::<3>(17)),
                ("extension, 2D", measured_calculus::<2>(33, 1, Some(2))),
                ("long extension, 2D", measured_calculus::<2>(33, 6, Some(1))),
                ("extension, 3D", measured_calculus::<3>(17, 2, Some(1))),
                ("transport, 2D", measured_calculus::<2>(33, 2, None)),
                ("transport, 3D", measured_calculus::<3>(17, 1, None)),
            ];
            println!("{ratios:.3?}");
            for (what, ratio) in ratios {
                assert!((0.85..1.2).contains(&ratio), "{what}: {ratio}");
            }
        },
    );
}

/// The sizes at which estimates matter take minutes.
#[test]
fn estimates_are_what_is_used_at_full_size() {
    in_own_process("estimates_are_what_is_used_at_full_size", || {
        if std::env::var_os("SHAPESPACE_SLOW_TESTS").is_none() {
            eprintln!("skipped: SHAPESPACE_SLOW_TESTS is not set");
            return;
        }
        check::<3>(65, 1, &short(Form::Lagrangian, 4));
        check::<3>(65, 2, &short(Form::Lagrangian, 2));
        check::<3>(65, 1, &short(Form::LevelSets, 2));
        check::<2>(513, 1, &short(Form::Lagrangian, 6));
    });
}
