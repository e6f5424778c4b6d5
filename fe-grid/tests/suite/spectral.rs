//! The spectral solver inverts the assembled operator.

use crate::support::assembled::{mass_matrix, stiffness_matrix};
use fe_grid::random::noise;
use fe_grid::vector::max_abs;
use fe_grid::vector::max_abs_difference;
use fe_grid::{Boundary, Grid, GridError, LinearOperator, SpectralSolver};
use proptest::prelude::*;
use test_support::{flat, on_threads, oracle};

fn on_boundary<const D: usize>(grid: &Grid<D>, index: usize) -> bool {
    let last = grid.cells_per_axis();
    let node = grid.node(index);
    (0..D).any(|k| node[k] == 0 || node[k] == last[k])
}

/// The residual in proportion to the size of the terms that cancel in it, so that it measures
/// rounding and not the condition number.
fn relative_residual<const D: usize>(
    grid: Grid<D>,
    mass: f64,
    stiffness: f64,
    boundary: Boundary,
    rhs: &[f64],
) -> f64 {
    let solver = SpectralSolver::new(grid, mass, stiffness, boundary).unwrap();
    let mut x = vec![f64::NAN; rhs.len()];
    solver.solve_into(rhs, &mut x);
    let matrix = mass_matrix(&grid).combined(mass, &stiffness_matrix(&grid), stiffness);
    let mut image = vec![0.0; rhs.len()];
    matrix.apply_into(&x, &mut image);
    let scale = max_abs(rhs) + matrix.largest() * max_abs(&x);
    let mut worst: f64 = 0.0;
    for i in 0..rhs.len() {
        if boundary == Boundary::Dirichlet && on_boundary(&grid, i) {
            assert_eq!(x[i], 0.0, "boundary values are exactly zero");
        } else {
            worst = worst.max((image[i] - rhs[i]).abs());
        }
    }
    worst / scale
}

fn boundary() -> impl Strategy<Value = Boundary> {
    prop_oneof![Just(Boundary::Natural), Just(Boundary::Dirichlet)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Primes, odd and even sides and the smallest ones; 1e-12 is asked for, some 1e-15 reached.
    #[test]
    fn inverts_the_assembled_matrix_in_2d(
        nx in 2usize..40, ny in 2usize..40, h in 0.01f64..2.0,
        mass in 0.1f64..10.0, stiffness in 0.0f64..10.0, boundary in boundary(), seed in 1u64..1000,
    ) {
        let grid = Grid::<2>::with_nodes([nx, ny], h).unwrap();
        let rhs = noise(grid.n_nodes(), seed);
        prop_assert!(relative_residual(grid, mass, stiffness, boundary, &rhs) < 1e-12);
    }

    #[test]
    fn inverts_the_assembled_matrix_in_3d(
        nx in 2usize..12, ny in 2usize..19, nz in 2usize..12, h in 0.01f64..2.0,
        mass in 0.1f64..10.0, stiffness in 0.0f64..10.0, boundary in boundary(), seed in 1u64..1000,
    ) {
        let grid = Grid::<3>::with_nodes([nx, ny, nz], h).unwrap();
        let rhs = noise(grid.n_nodes(), seed);
        prop_assert!(relative_residual(grid, mass, stiffness, boundary, &rhs) < 1e-12);
    }
}

/// More than one chunk of planes and more than one block of columns in every direction.
#[test]
fn residual_is_rounding_on_larger_grids() {
    for boundary in [Boundary::Natural, Boundary::Dirichlet] {
        let flat = Grid::<2>::with_nodes([129, 65], 1.0 / 64.0).unwrap();
        let rhs = noise(flat.n_nodes(), 1);
        assert!(relative_residual(flat, 1.0, 0.5, boundary, &rhs) < 1e-12);
        let solid = Grid::<3>::with_nodes([33, 17, 25], 1.0 / 32.0).unwrap();
        let rhs = noise(solid.n_nodes(), 2);
        assert!(relative_residual(solid, 1.0, 0.5, boundary, &rhs) < 1e-12);
    }
}

/// A pure stiffness matrix has an inverse where the boundary is held.
#[test]
fn poisson_problem_without_mass() {
    let grid = Grid::<2>::cube(33);
    let rhs = noise(grid.n_nodes(), 3);
    assert!(relative_residual(grid, 0.0, 1.0, Boundary::Dirichlet, &rhs) < 1e-12);
}

#[test]
fn a_singular_operator_is_refused() {
    let grid = Grid::<3>::cube(5);
    let singular = SpectralSolver::new(grid, 0.0, 1.0, Boundary::Natural).err();
    let Some(GridError::NotPositiveDefinite { curvature, .. }) = singular else {
        panic!("{singular:?}");
    };
    assert_eq!(curvature, 0.0);
    assert!(SpectralSolver::new(grid, -1.0, 0.0, Boundary::Natural).is_err());
    assert!(SpectralSolver::new(grid, f64::NAN, 1.0, Boundary::Natural).is_err());
}

#[test]
fn components_are_solved_one_by_one() {
    let grid = Grid::<3>::with_nodes([5, 9, 7], 0.2).unwrap();
    let n = grid.n_nodes();
    let solver = SpectralSolver::new(grid, 1.0, 0.3, Boundary::Natural).unwrap();
    let rhs = noise(3 * n, 4);
    let mut scalar = vec![0.0; 3 * n];
    for c in 0..3 {
        solver.solve_into(&rhs[c * n..(c + 1) * n], &mut scalar[c * n..(c + 1) * n]);
    }
    let solver = solver.with_components(3);
    assert_eq!(solver.dim(), 3 * n);
    let mut vector = vec![0.0; 3 * n];
    solver.apply_into(&rhs, &mut vector);
    assert_eq!(scalar, vector);
}

#[test]
fn same_bits_on_any_number_of_threads() {
    fn bits<const D: usize>(grid: Grid<D>, threads: usize) -> Vec<u64> {
        let rhs = noise(grid.n_nodes(), 5);
        let solver = SpectralSolver::new(grid, 1.0, 0.1, Boundary::Natural).unwrap();
        let mut x = vec![0.0; rhs.len()];
        on_threads(threads, || solver.solve_into(&rhs, &mut x));
        x.iter().map(|v| v.to_bits()).collect()
    }
    let flat = Grid::<2>::with_nodes([97, 129], 0.01).unwrap();
    let solid = Grid::<3>::with_nodes([33, 17, 25], 0.01).unwrap();
    for threads in [2, 3] {
        assert_eq!(bits(flat, 1), bits(flat, threads));
        assert_eq!(bits(solid, 1), bits(solid, threads));
    }
}

/// Reference values of another implementation, to the tolerance that they state.
fn check_oracle<const D: usize>(name: &str) {
    let Some(file) = oracle(name) else { return };
    let tolerance = file["tolerance_rel"].as_f64().unwrap();
    let grid = Grid::<D>::cube(file["n"].as_u64().unwrap() as usize);
    let cases = file["cases"].as_array().unwrap();
    let mut found = 0;
    for case in cases.iter().filter(|case| case["kind"] == "h1_metric") {
        found += 1;
        let f = flat(&case["inputs"]["f"]);
        let sigma = case["inputs"]["sigma"].as_f64().unwrap();
        let check = |label: &str, computed: &[f64]| {
            let expected = flat(&case[label]);
            let scale = max_abs(&expected);
            assert!(
                max_abs_difference(computed, &expected) < tolerance * scale,
                "{label}"
            );
        };
        let mut out = vec![0.0; f.len()];
        mass_matrix(&grid).apply_into(&f, &mut out);
        check("M_f", &out);
        stiffness_matrix(&grid).apply_into(&f, &mut out);
        check("L_f", &out);
        for (label, boundary) in [
            ("solve_natural", Boundary::Natural),
            ("solve_dirichlet", Boundary::Dirichlet),
        ] {
            let solver = SpectralSolver::new(grid, 1.0, sigma * sigma / 2.0, boundary).unwrap();
            solver.solve_into(&f, &mut out);
            check(label, &out);
        }
    }
    assert!(found > 0, "{name} has a case of this kind");
}

#[test]
fn metric_matches_the_oracle_in_2d() {
    check_oracle::<2>("grid2d_n5.json");
}

#[test]
fn metric_matches_the_oracle_in_3d() {
    check_oracle::<3>("grid3d_n5.json");
}
