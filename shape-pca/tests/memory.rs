//! The estimate of the memory of an analysis against what is asked of the allocator.

#[path = "suite/support/mod.rs"]
mod support;

use fe_grid::Grid;
use fe_grid::minimise::Silent;
use peak_alloc::PeakAlloc;
use shape_pca::{
    Average, Balancing, Compound, Finite, Pca, PcaParams, memory_estimate,
    memory_estimate_of_response,
};
use support::{blob, smooth};
use test_support::{in_own_process, on_threads};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// An average of shapes that differ.
fn average<const D: usize>(grid: Grid<D>, n_shapes: usize) -> Average<D> {
    let share = |i: usize| i as f64 / n_shapes as f64;
    let displacements = (0..n_shapes).map(|i| smooth(grid, 0.03, 4.0 * share(i)));
    let indicators = (0..n_shapes).map(|i| blob(grid, 0.25 + 0.05 * share(i)));
    let weights = vec![1.0 / n_shapes as f64; n_shapes];
    Average::new(displacements.collect(), indicators.collect(), weights).unwrap()
}

/// The estimate of modes, or of the balancing before them, on one thread, over the most memory in use.
fn measured<const D: usize>(nodes: usize, n_shapes: usize, balances: bool) -> f64 {
    on_threads(1, || {
        let before = ALLOCATOR.current_usage();
        let grid = Grid::<D>::cube(nodes);
        let average = average(grid, n_shapes);
        ALLOCATOR.reset_peak_usage();
        let params = PcaParams::default();
        if balances {
            let balancing = Balancing {
                enough: 0.0,
                target: 0.02,
                ..Balancing::default()
            };
            let result = balancing.balance(&average, &params, &mut Silent).unwrap();
            assert!(result.1.imbalance.len() > 1);
        } else {
            let compound = Compound::new(&average, &params).unwrap();
            Pca::new(&average, &compound, 3, &mut Silent).unwrap();
        }
        let most = ALLOCATOR.peak_usage() - before;
        memory_estimate(n_shapes, 3, balances, &grid) as f64 / most as f64
    })
}

/// The estimate of the nonlinear response to a small load, without modes, over the most memory in use.
fn measured_response<const D: usize>(nodes: usize, n_shapes: usize) -> f64 {
    on_threads(1, || {
        let before = ALLOCATOR.current_usage();
        let grid = Grid::<D>::cube(nodes);
        let average = average(grid, n_shapes);
        ALLOCATOR.reset_peak_usage();
        let compound = Compound::new(&average, &PcaParams::default()).unwrap();
        let load = compound.apply(smooth(grid, 1e-3, 1.0).as_slice());
        let problem = Finite::new(&average, &compound);
        let (_, report) = problem.respond(&load, &mut Silent).unwrap();
        assert!(report.steps[0].iterations > 1);
        let most = ALLOCATOR.peak_usage() - before;
        memory_estimate_of_response(n_shapes, 0, &grid) as f64 / most as f64
    })
}

fn check<const D: usize>(nodes: usize, n_shapes: usize, balances: bool) {
    let ratio = measured::<D>(nodes, n_shapes, balances);
    println!("{D}D, {n_shapes} at {nodes}, {balances}: {ratio:.3}");
    // What is not counted is small.
    assert!(
        (0.88..1.12).contains(&ratio),
        "{D}D {n_shapes} at {nodes} {balances}: {ratio}"
    );
}

fn check_all(balances: bool) {
    check::<2>(65, 2, balances);
    check::<2>(65, 7, balances);
    check::<3>(17, 3, balances);
}

#[test]
fn estimates_of_modes_are_what_is_used() {
    in_own_process("estimates_of_modes_are_what_is_used", || {
        check_all(false);
    });
}

#[test]
fn estimates_of_balancing_are_what_is_used() {
    in_own_process("estimates_of_balancing_are_what_is_used", || {
        check_all(true);
    });
}

#[test]
fn estimates_of_responses_are_what_is_used() {
    in_own_process("estimates_of_responses_are_what_is_used", || {
        let responses = [measured_response::<2>(65, 3), measured_response::<3>(17, 2)];
        println!("responses: {responses:.3?}");
        for ratio in responses {
            assert!((0.88..1.12).contains(&ratio), "{responses:?}");
        }
    });
}
