//! The estimate of the memory of a path against what is asked of the allocator.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use geodesic::{Form, GeodesicParams, Shape, geodesic_between, memory_estimate};
use peak_alloc::PeakAlloc;
use std::sync::Mutex;
use test_support::on_threads;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;
/// Tests of one program share its allocator: one at a time, from beginning to end.
static ALONE: Mutex<()> = Mutex::new(());

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
        steps,
        max_iterations: Some(12),
        ..GeodesicParams::default()
    }
}

#[test]
fn estimates_are_what_is_used() {
    let _alone = ALONE.lock();
    for steps in [1, 4] {
        check::<2>(65, 1, &short(Form::Lagrangian, steps));
    }
    check::<3>(33, 1, &short(Form::Lagrangian, 2));
    check::<2>(65, 3, &short(Form::Lagrangian, 3));
    check::<2>(65, 2, &short(Form::LevelSets, 3));
}

/// The sizes at which estimates matter take minutes.
#[test]
fn estimates_are_what_is_used_at_full_size() {
    if std::env::var_os("SHAPESPACE_SLOW_TESTS").is_none() {
        eprintln!("skipped: SHAPESPACE_SLOW_TESTS is not set");
        return;
    }
    let _alone = ALONE.lock();
    check::<3>(65, 1, &short(Form::Lagrangian, 4));
    check::<3>(65, 2, &short(Form::Lagrangian, 2));
    check::<3>(65, 1, &short(Form::LevelSets, 2));
    check::<2>(513, 1, &short(Form::Lagrangian, 6));
}
