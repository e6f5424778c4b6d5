//! The model of the Hessian of the reduced functional.

use crate::support::shapes::ellipsoid;
use fe_grid::minimise::{Evaluation, Objective, SecondOrder};
use fe_grid::vector::dot;
use fe_grid::{Grid, ScalarField};
use shape_average::{AverageObjective, AverageParams, BoundaryCondition, LevelShapes};
use std::f64::consts::PI;

/// Smooth displacements of all shapes: waves of a given phase.
fn waves<const D: usize>(grid: &Grid<D>, n: usize, size: f64, phase: f64) -> Vec<f64> {
    let mut x = Vec::new();
    for i in 0..n {
        for k in 0..D {
            for node in 0..grid.n_nodes() {
                let p = grid.position(grid.node(node));
                let wave = (2.0 * PI * p[(k + 1) % D] + phase + i as f64).sin();
                x.push(size * wave * (PI * p[k] + 0.5 * phase).cos());
            }
        }
    }
    x
}

/// The objective of ellipses, at a smooth state; `seen` hides a part of the second.
fn objective<const D: usize>(
    grid: Grid<D>,
    params: &AverageParams,
    seen: bool,
) -> (AverageObjective<D>, Vec<f64>) {
    let mut radii = [0.2; D];
    radii[0] = 0.3;
    let shapes: Vec<ScalarField<f64, D>> = [0.0, 0.2].map(|t| ellipsoid(grid, radii, t)).into();
    let mut level = LevelShapes::new(grid, &shapes, params).unwrap();
    if seen {
        let masks = [0.0, 1.0].map(|hide| ScalarField::from_fn(grid, |p| [1.0 - hide * p[0]]));
        level = level.with_visibility(masks.into());
    }
    let average = vec![1.0; grid.n_nodes()];
    let mut objective = AverageObjective::new(level, params, average).unwrap();
    let x = waves(&grid, 2, 0.01, 0.3);
    let mut gradient = vec![0.0; x.len()];
    let found = objective.value_and_gradient(&x, &mut gradient).unwrap();
    assert!(matches!(found, Evaluation::Value(_)));
    (objective, x)
}

/// Symmetric and positive, and without stiffness of the mismatch where all shapes move together:
/// a common translation costs less than a thousandth of the opposite one.
fn check<const D: usize>(grid: Grid<D>, params: &AverageParams, seen: bool) {
    let (mut objective, x) = objective(grid, params, seen);
    let mut image = |d: &[f64]| {
        let mut out = vec![0.0; d.len()];
        objective.hessian_action(&x, d, &mut out).unwrap();
        out
    };
    let mut a = waves(&grid, 2, 1.0, 1.0);
    let mut b = waves(&grid, 2, 1.0, 2.5);
    if params.boundary == BoundaryCondition::Identity {
        for direction in [&mut a, &mut b] {
            for (i, value) in direction.iter_mut().enumerate() {
                let node = grid.node(i % grid.n_nodes());
                let last = grid.nodes_per_axis()[0] - 1;
                if node.iter().any(|&k| k == 0 || k == last) {
                    *value = 0.0;
                }
            }
        }
    }
    let (of_a, of_b) = (image(&a), image(&b));
    let (left, right) = (dot(&a, &of_b), dot(&b, &of_a));
    let size = (dot(&a, &of_a) * dot(&b, &of_b)).sqrt();
    // The change of the average is solved for to 1e-3.
    assert!((left - right).abs() <= 1e-3 * size, "{left} {right} {size}");
    assert!(dot(&a, &of_a) > 0.0 && dot(&b, &of_b) > 0.0);
    if params.boundary == BoundaryCondition::Natural && !seen {
        let n = D * grid.n_nodes();
        let translation = |sign: f64| {
            let component = |i: usize| if i % n < n / D { 1.0 } else { 0.0 };
            let factor = |i: usize| if i < n { 1.0 } else { sign };
            (0..2 * n)
                .map(|i| component(i) * factor(i))
                .collect::<Vec<f64>>()
        };
        let mut cost = |sign| {
            let d = translation(sign);
            dot(&d, &image(&d))
        };
        let (common, opposite) = (cost(1.0), cost(-1.0));
        assert!(common.abs() < 1e-3 * opposite, "{common} {opposite}");
    }
}

#[test]
fn the_hessian_is_symmetric_and_lets_all_shapes_move_together() {
    let params = AverageParams::default();
    check(Grid::<2>::dyadic(5), &params, false);
    check(Grid::<2>::dyadic(5), &params, true);
    check(Grid::<3>::dyadic(4), &params, false);
    let held = AverageParams {
        boundary: BoundaryCondition::Identity,
        weights: Some(vec![0.3, 0.7]),
        ..params
    };
    check(Grid::<2>::dyadic(5), &held, false);
}

/// Against central differences of the gradient, over a step of half a cell, which passes many
/// kinks: the curvatures along smooth directions agree to 10 %. The interface is wide, so that the
/// average is smooth on the scale of a cell.
fn check_against_differences<const D: usize>(grid: Grid<D>, params: &AverageParams) {
    let (mut objective, x) = objective(grid, params, false);
    for phase in [0.7, 1.9] {
        let d = waves(&grid, 2, 1.0, phase);
        let step = 0.5 * grid.spacing();
        let mut image = vec![0.0; d.len()];
        let mut gradient = vec![0.0; d.len()];
        objective.value_and_gradient(&x, &mut gradient).unwrap();
        objective.hessian_action(&x, &d, &mut image).unwrap();
        let mut slope = |t: f64| {
            let moved: Vec<f64> = x.iter().zip(&d).map(|(x, d)| x + t * d).collect();
            objective.value_and_gradient(&moved, &mut gradient).unwrap();
            dot(&gradient, &d)
        };
        let difference = (slope(step) - slope(-step)) / (2.0 * step);
        let curvature = dot(&d, &image);
        assert!((curvature / difference - 1.0).abs() < 0.1);
    }
}

#[test]
fn the_hessian_is_the_mean_change_of_the_gradient() {
    let params = AverageParams {
        interface_cells: 6.0,
        ..AverageParams::default()
    };
    check_against_differences(Grid::<2>::dyadic(6), &params);
    check_against_differences(Grid::<3>::dyadic(4), &params);
}
