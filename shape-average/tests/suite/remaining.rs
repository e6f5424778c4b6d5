//! The estimate of the remaining energy, against runs that go on to the minimum.

use crate::support::shapes::{ball, bar, ellipsoid};
use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use shape_average::{AverageParams, BoundaryCondition, average};

/// Tolerances, and the factor by which the estimate may differ there. Close to the minimum the jumps of
/// the discrete mismatch, which the estimate does not see, are a part of what remains.
const TOLERANCES: [(f64, f64); 2] = [(1.5e-2, 3.0), (5e-3, 8.0)];

/// Stops at several tolerances and compares the estimate with the energy that a longer run still wins.
///
/// The energy of the longer run still differs from its limit by some hundredths of the remaining
/// energy.
fn check<const D: usize>(name: &str, shapes: &[ScalarField<f64, D>], params: &AverageParams) {
    let energy = |tolerance: f64| {
        let params = AverageParams {
            tolerance,
            max_iterations: 3000,
            ..params.clone()
        };
        let result = average(shapes, &params, &mut Silent).unwrap();
        assert!(result.status.converged());
        result.energy
    };
    let limit = energy(2e-5).objective();
    for (tolerance, factor) in TOLERANCES {
        let stopped = energy(tolerance);
        let estimate = stopped.remaining.expect("L-BFGS");
        let true_value = stopped.objective() - limit;
        let ratio = estimate / true_value;
        println!("{name}, {tolerance}: {estimate:.2e} for {true_value:.2e}, ratio {ratio:.2}");
        let range = 1.0 / factor..factor;
        assert!(range.contains(&ratio), "{name}, {tolerance}: {ratio}");
    }
}

fn bars(angles: &[f64]) -> Vec<ScalarField<f64, 2>> {
    let bars = angles.iter().map(|a| bar(Grid::dyadic(6), *a, 0.0));
    bars.collect()
}

#[test]
fn the_remaining_energy_is_estimated() {
    let default = AverageParams::default();
    let two = bars(&[180.0, 118.0]);
    check("two bars", &two, &default);
    let weighted = AverageParams {
        weights: Some(vec![0.25, 0.75]),
        ..default.clone()
    };
    check("weighted bars", &two, &weighted);
    let held = AverageParams {
        boundary: BoundaryCondition::Identity,
        ..default.clone()
    };
    check("fixed boundary", &two, &held);
    let many = bars(&[180.0, 165.0, 150.0, 135.0, 118.0]);
    check("five bars", &many, &default);
    let balls = [0.2, 0.3].map(|r| ball(Grid::<2>::dyadic(6), [0.5; 2], r));
    check("balls", &balls, &default);
}

#[test]
fn the_remaining_energy_is_estimated_in_3d() {
    let shapes: Vec<_> = (0..3)
        .map(|i| {
            let i = f64::from(i);
            ellipsoid(Grid::<3>::dyadic(4), [0.28, 0.18 + 0.03 * i, 0.2], 0.25 * i)
        })
        .collect();
    check("ellipsoids", &shapes, &AverageParams::default());
}
