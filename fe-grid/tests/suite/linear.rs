//! Reductions and conjugate gradients.

use crate::support::assembled::{Matrix, mass_matrix, stiffness_matrix};
use crate::support::assembled::{weighted_mass_matrix, weighted_stiffness_matrix};
use approx::assert_relative_eq;
use fe_grid::linear::residual_norm;
use fe_grid::random::noise;
use fe_grid::vector::max_abs_difference;
use fe_grid::{
    Boundary, CgInfo, CgParams, CgScratch, CgStatus, Diagonal, Grid, GridError, Identity,
    LinearOperator, SpectralSolver, conjugate_gradient, vector,
};
use proptest::prelude::*;
use test_support::on_threads;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Every length around the chunk and the threshold; sums against plain loops, up to rounding.
    #[test]
    fn reductions_agree_with_plain_loops(
        chunks in 0usize..12, extra in 0usize..20, seed in 1u64..1000,
    ) {
        let n = chunks * vector::CHUNK + extra;
        let (x, y) = (noise(n, seed), noise(n, seed + 7));
        let plain: f64 = x.iter().zip(&y).map(|(a, b)| a * b).sum();
        let bound = 1e-15 * n as f64;
        prop_assert!((vector::dot(&x, &y) - plain).abs() <= bound);
        prop_assert!((vector::sum(&x) - x.iter().sum::<f64>()).abs() <= bound);
        prop_assert!((vector::norm(&x).powi(2) - vector::dot(&x, &x)).abs() <= bound);
        let largest = x.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        prop_assert_eq!(vector::max_abs(&x), largest);
    }

    /// Updates are elementwise: the same bits as a plain loop.
    #[test]
    fn updates_agree_with_plain_loops(
        chunks in 0usize..12, extra in 0usize..20, a in -2.0f64..2.0, seed in 1u64..1000,
    ) {
        let n = chunks * vector::CHUNK + extra;
        let (x, y) = (noise(n, seed), noise(n, seed + 7));
        let check = |f: &dyn Fn(&mut [f64]), plain: &dyn Fn(f64, f64) -> f64| {
            let mut out = y.clone();
            f(&mut out);
            out.iter().zip(x.iter().zip(&y)).all(|(o, (&u, &v))| *o == plain(u, v))
        };
        prop_assert!(check(&|out| vector::axpy(a, &x, out), &|u, v| v + a * u));
        prop_assert!(check(&|out| vector::aypx(a, &x, out), &|u, v| u + a * v));
        prop_assert!(check(&|out| vector::scale(a, out), &|_, v| a * v));
        prop_assert!(check(&|out| vector::copy_into(&x, out), &|u, _| u));
        prop_assert!(check(&|out| vector::fill(a, out), &|_, _| a));
        prop_assert!(check(&|out| vector::add_scaled_into(&x, a, &y, out), &|u, v| u + a * v));
        prop_assert!(check(&|out| vector::subtract_into(&x, &y, out), &|u, v| u - v));
        prop_assert!(check(&|out| vector::multiply_into(&x, &y, out), &|u, v| u * v));
    }
}

#[test]
fn largest_value_does_not_hide_nan() {
    let mut x = noise(100_000, 1);
    x[70_000] = f64::NAN;
    assert!(vector::max_abs(&x).is_nan());
    assert_eq!(vector::max_abs(&[]), 0.0);
}

/// Long enough that partial sums are collected in more than one round.
#[test]
fn sums_have_the_same_bits_on_any_number_of_threads() {
    let n = 600 * vector::CHUNK + 13;
    let (x, y) = (noise(n, 2), noise(n, 3));
    let bits = |threads| on_threads(threads, || vector::dot(&x, &y)).to_bits();
    assert_eq!(bits(1), bits(2));
    assert_eq!(bits(1), bits(5));
}

/// `M[ω] + h² L[ω]` with a coefficient that jumps by a thousand: badly conditioned by the jump
/// alone, which the diagonal takes off.
fn hard_operator(grid: &Grid<2>) -> Matrix {
    let jump = |cell: usize, _: usize| if cell % 7 < 3 { 1.0 } else { 1e-3 };
    let stiffness = weighted_stiffness_matrix(grid, jump);
    weighted_mass_matrix(grid, jump).combined(1.0, &stiffness, grid.spacing().powi(2))
}

fn solve(
    operator: &dyn LinearOperator,
    preconditioner: &dyn LinearOperator,
    b: &[f64],
    x: &mut [f64],
) -> CgInfo {
    let mut scratch = CgScratch::new(b.len());
    let params = CgParams::default();
    conjugate_gradient(operator, preconditioner, b, x, &params, &mut scratch).unwrap()
}

#[test]
fn conjugate_gradients_solve_and_jacobi_helps() {
    let grid = Grid::<2>::cube(33);
    let operator = hard_operator(&grid);
    let n = operator.dim();
    let expected = noise(n, 4);
    let mut b = vec![0.0; n];
    operator.apply_into(&expected, &mut b);

    let mut plain = vec![0.0; n];
    let without = solve(&operator, &Identity { dim: n }, &b, &mut plain);
    let jacobi = Diagonal::jacobi(&operator.diagonal()).unwrap();
    let mut x = vec![0.0; n];
    let with = solve(&operator, &jacobi, &b, &mut x);

    assert_eq!(without.status, CgStatus::Converged);
    assert_eq!(with.status, CgStatus::Converged);
    assert!(
        2 * with.iterations < without.iterations,
        "{with:?} {without:?}"
    );
    // The recursion's residual is the true one up to rounding: twice the tolerance asked for.
    assert!(residual_norm(&operator, &b, &x) < 2e-10 * vector::norm(&b));
    // The tolerance 1e-10 times the condition number, some 1e3 from the jump and 10 besides.
    assert!(max_abs_difference(&x, &expected) < 1e-6);
}

#[test]
fn a_warm_start_needs_no_iterations() {
    let grid = Grid::<2>::cube(17);
    let operator = hard_operator(&grid);
    let identity = Identity {
        dim: operator.dim(),
    };
    let b = noise(operator.dim(), 5);
    let mut x = vec![0.0; b.len()];
    let cold = solve(&operator, &identity, &b, &mut x);
    assert!(cold.iterations > 10);
    let params = CgParams {
        relative_tolerance: 1e-9,
        ..CgParams::default()
    };
    let mut scratch = CgScratch::default();
    let warm = conjugate_gradient(&operator, &identity, &b, &mut x, &params, &mut scratch);
    assert_eq!(warm.unwrap().iterations, 0);
}

#[test]
fn the_exact_inverse_converges_at_once() {
    let grid = Grid::<3>::with_nodes([9, 7, 5], 0.1).unwrap();
    let operator = mass_matrix(&grid).combined(1.0, &stiffness_matrix(&grid), 0.2);
    let inverse = SpectralSolver::new(grid, 1.0, 0.2, Boundary::Natural).unwrap();
    let b = noise(operator.dim(), 6);
    let mut x = vec![0.0; b.len()];
    let info = solve(&operator, &inverse, &b, &mut x);
    assert_eq!((info.iterations, info.status), (1, CgStatus::Converged));
}

#[test]
fn zero_right_hand_side_has_the_zero_solution() {
    let operator = Diagonal::new(vec![1.0, 2.0]);
    let mut x = vec![3.0, 4.0];
    let info = solve(&operator, &Identity { dim: 2 }, &[0.0, 0.0], &mut x);
    assert_eq!((info.status, info.iterations), (CgStatus::Converged, 0));
    assert_eq!(x, [0.0, 0.0]);
}

#[test]
fn indefinite_operators_are_named() {
    let identity = Identity { dim: 2 };
    let mut scratch = CgScratch::new(2);
    let params = CgParams::default();
    let mut attempt = |operator: &Diagonal, preconditioner: &dyn LinearOperator| {
        let mut x = [0.0, 0.0];
        let b = [1.0, 1.0];
        conjugate_gradient(operator, preconditioner, &b, &mut x, &params, &mut scratch)
    };
    // r · A r = 1 - 3, then for the preconditioner r · P r = 1 - 2.
    assert_eq!(
        attempt(&Diagonal::new(vec![1.0, -3.0]), &identity),
        Err(GridError::NotPositiveDefinite {
            curvature: -2.0,
            iteration: 0
        })
    );
    let indefinite = Diagonal::new(vec![1.0, -2.0]);
    assert_eq!(
        attempt(&Diagonal::new(vec![1.0, 3.0]), &indefinite),
        Err(GridError::NotPositiveDefinite {
            curvature: -1.0,
            iteration: 0
        })
    );
    assert!(attempt(&Diagonal::new(vec![1.0, f64::NAN]), &identity).is_err());
    assert!(Diagonal::jacobi(&[1.0, 0.0]).is_err());
}

#[test]
fn the_iteration_limit_is_a_status() {
    let operator = hard_operator(&Grid::<2>::cube(17));
    let b = noise(operator.dim(), 7);
    let mut x = vec![0.0; b.len()];
    let params = CgParams {
        max_iterations: 3,
        ..CgParams::default()
    };
    let identity = Identity { dim: b.len() };
    let mut scratch = CgScratch::default();
    let info = conjugate_gradient(&operator, &identity, &b, &mut x, &params, &mut scratch).unwrap();
    assert_eq!((info.iterations, info.status), (3, CgStatus::MaxIterations));
    assert_relative_eq!(
        info.residual,
        residual_norm(&operator, &b, &x),
        max_relative = 1e-12
    );
}

/// `1 · M 1` is the volume, `L 1 = 0`, and `x · L x` is the volume for `x` a coordinate.
#[test]
fn assembled_matrices_integrate_linear_functions_exactly() {
    fn check<const D: usize>(grid: Grid<D>) {
        let volume: f64 = grid.extent().iter().product();
        let ones = vec![1.0; grid.n_nodes()];
        let mut image = ones.clone();
        mass_matrix(&grid).apply_into(&ones, &mut image);
        assert_relative_eq!(vector::sum(&image), volume, max_relative = 1e-13);
        let stiffness = stiffness_matrix(&grid);
        stiffness.apply_into(&ones, &mut image);
        assert!(vector::max_abs(&image) < 1e-14);
        for k in 0..D {
            let x: Vec<f64> = (0..ones.len())
                .map(|i| grid.position(grid.node(i))[k])
                .collect();
            stiffness.apply_into(&x, &mut image);
            assert_relative_eq!(vector::dot(&x, &image), volume, max_relative = 1e-13);
        }
    }
    check(Grid::<2>::with_nodes([4, 7], 0.3).unwrap());
    check(Grid::<3>::with_nodes([4, 3, 5], 0.3).unwrap());
}

/// A weight that is a coordinate itself, given at the Gauss points: `1 · M[x_k] 1 = ∫ x_k`.
#[test]
fn weights_are_taken_at_the_gauss_points() {
    let grid = Grid::<3>::with_nodes([4, 3, 5], 0.3).unwrap();
    let volume: f64 = grid.extent().iter().product();
    let ones = vec![1.0; grid.n_nodes()];
    let mut image = ones.clone();
    for k in 0..3 {
        let coordinate = |cell: usize, q: usize| {
            let sign = if q >> k & 1 == 1 { 1.0 } else { -1.0 };
            let local = 0.5 + sign * 0.5 / 3.0f64.sqrt();
            (grid.cell(cell)[k] as f64 + local) * grid.spacing()
        };
        weighted_mass_matrix(&grid, coordinate).apply_into(&ones, &mut image);
        let expected = volume * grid.extent()[k] / 2.0;
        assert_relative_eq!(vector::sum(&image), expected, max_relative = 1e-13);
    }
}

#[test]
fn a_right_side_that_is_not_finite_is_refused() {
    let operator = Identity { dim: 3 };
    for value in [f64::NAN, f64::INFINITY] {
        let (b, mut x) = ([1.0, value, 0.0], [0.0; 3]);
        let params = CgParams::default();
        let mut scratch = CgScratch::default();
        let found = conjugate_gradient(&operator, &operator, &b, &mut x, &params, &mut scratch);
        assert!(matches!(found, Err(GridError::NotFinite { .. })));
    }
}
