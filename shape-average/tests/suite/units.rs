//! Energies are proportional to the moduli and weights, whose unit is free.

use crate::support::shapes::{ball, bar};
use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use hyperelastic::{LameModuli, LawSpec};
use shape_average::{AverageParams, AverageResult, Mean, Solver, average};

/// The average with all moduli and weights times a factor.
fn scaled<const D: usize>(
    shapes: &[ScalarField<f64, D>],
    params: &AverageParams,
    factor: f64,
) -> AverageResult<D> {
    let LameModuli { lambda, mu } = params.law.moduli;
    let moduli = LameModuli::new(factor * lambda, factor * mu).unwrap();
    let params = AverageParams {
        law: LawSpec {
            moduli,
            ..params.law
        },
        mismatch_weight: factor * params.mismatch_weight,
        length_weight: Some(factor * params.resolved_length_weight()),
        ..params.clone()
    };
    average(shapes, &params, &mut Silent).unwrap()
}

/// A power of two changes exponents and no other bit of any number, so that both runs make the same
/// decisions: a constant that is not relative to the moduli or weights would change them.
fn check<const D: usize>(shapes: &[ScalarField<f64, D>], params: &AverageParams) {
    let one = scaled(shapes, params, 1.0);
    for power in [-20, 20] {
        let factor = 2.0f64.powi(power);
        let other = scaled(shapes, params, factor);
        assert_eq!(other.average, one.average, "2^{power}");
        assert!(other.displacements == one.displacements, "2^{power}");
        assert_eq!(other.energy.total, factor * one.energy.total, "2^{power}");
        assert_eq!(other.energy.barrier, factor * one.energy.barrier);
        assert_eq!(
            other.energy.remaining,
            one.energy.remaining.map(|remaining| factor * remaining)
        );
    }
}

fn shapes() -> [ScalarField<f64, 2>; 3] {
    let grid = Grid::dyadic(5);
    [
        bar(grid, 180.0, 0.0),
        bar(grid, 118.0, 0.0),
        ball(grid, [0.5; 2], 0.25),
    ]
}

#[test]
fn averages_have_no_unit() {
    let grid = Grid::<3>::dyadic(3);
    let balls = [ball(grid, [0.5; 3], 0.2), ball(grid, [0.45; 3], 0.3)];
    check(&shapes(), &AverageParams::default());
    check(&balls, &AverageParams::default());
    let of_weight_zero = AverageParams {
        weights: Some(vec![0.5, 0.5, 0.0]),
        ..AverageParams::default()
    };
    check(&shapes(), &of_weight_zero);
}

#[test]
fn medians_have_no_unit() {
    let median = AverageParams {
        mean: Mean::Median,
        ..AverageParams::default()
    };
    check(&shapes(), &median);
    // Equal shapes, whose energies are below the least reference.
    let grid = Grid::dyadic(4);
    check(
        &[ball(grid, [0.5; 2], 0.25), ball(grid, [0.5; 2], 0.25)],
        &median,
    );
}

#[test]
fn descents_have_no_unit() {
    let descent = AverageParams {
        solver: Solver::Descent,
        descent_steps: 3,
        ..AverageParams::default()
    };
    check(&shapes(), &descent);
}
