//! Shared by the integration tests.
#![allow(dead_code, reason = "every test binary uses a part of it")]

pub mod angle;
pub mod shapes;

use fe_grid::ScalarField;
use fe_grid::minimise::Silent;
use shape_average::{AverageParams, AverageResult, average};

/// The average, checked for what holds for every average.
pub fn run<const D: usize>(
    shapes: &[ScalarField<f64, D>],
    params: &AverageParams,
) -> AverageResult<D> {
    let result = average(shapes, params, &mut Silent).unwrap();
    check_always(&result, shapes.len(), params);
    result
}

/// What holds for every average.
fn check_always<const D: usize>(result: &AverageResult<D>, n: usize, params: &AverageParams) {
    assert!(result.certificate.certified);
    assert!(result.certificate.min_det > params.min_determinant);
    assert_eq!((result.displacements.len(), result.dice.len()), (n, n));
    for level in &result.levels {
        assert!(level.certificate.certified);
        assert!(level.energies.windows(2).all(|w| w[1] <= w[0]), "{level:?}");
        assert_eq!(level.energies.len(), level.iterations + 1);
        // The terms that are reported add up to the energy that was minimised.
        let last = level.energies[level.iterations];
        assert!((level.energy.objective() - last).abs() <= 1e-8 * last);
        let weights = params.resolved_weights(n);
        let elastic: f64 = level
            .energy
            .elastic
            .iter()
            .zip(&weights)
            .map(|(w, l)| w * l)
            .sum();
        let mismatch: f64 = level.energy.mismatch.iter().sum();
        let total = elastic
            + params.mismatch_weight / n as f64 * mismatch
            + params.resolved_length_weight() * level.energy.length;
        assert!((total - level.energy.total).abs() <= 1e-12 * total);
    }
    println!(
        "{:?} dice {:?} iterations {:?} {:.2}s",
        result.status,
        result.dice,
        result
            .levels
            .iter()
            .map(|l| l.iterations)
            .collect::<Vec<_>>(),
        result.seconds
    );
}
