//! Mass and stiffness with constant coefficients: one operator in three guises, and its bits.

use crate::support::assembled::{mass_matrix, stiffness_matrix};
use fe_grid::operators::MassStiffness;
use fe_grid::random::noise;
use fe_grid::vector::max_abs_difference;
use fe_grid::{Assembly, Data, Grid, LinearOperator, SimdLevel, UniformOperator, vector};
use proptest::prelude::*;
use test_support::on_threads;

const MASS: MassStiffness = MassStiffness {
    mass: 1.0,
    stiffness: 0.0,
};
const STIFFNESS: MassStiffness = MassStiffness {
    mass: 0.0,
    stiffness: 1.0,
};

fn product<const D: usize>(grid: Grid<D>, coefficients: MassStiffness, x: &[f64]) -> Vec<f64> {
    let mut y = vec![f64::NAN; x.len()];
    UniformOperator::new(grid, coefficients).product_into(x, &mut y);
    y
}

fn agrees_with_its_twins<const D: usize>(
    nodes: [usize; D],
    coefficients: MassStiffness,
    seed: u64,
) -> Result<(), TestCaseError> {
    let grid = Grid::with_nodes(nodes, 0.3).unwrap();
    let x = noise(grid.n_nodes(), seed);
    let y = product(grid, coefficients, &x);
    let mut engine = vec![0.0; x.len()];
    Assembly::<_, f64, D, 1>::new(grid, &coefficients, Data::default()).hessian_action_into(
        &x,
        &x,
        &mut engine,
    );
    let (mut of_mass, mut of_stiffness) = (engine.clone(), engine.clone());
    mass_matrix(&grid).apply_into(&x, &mut of_mass);
    stiffness_matrix(&grid).apply_into(&x, &mut of_stiffness);
    let MassStiffness { mass, stiffness } = coefficients;
    let assembled: Vec<f64> = of_mass
        .iter()
        .zip(&of_stiffness)
        .map(|(m, l)| mass * m + stiffness * l)
        .collect();
    // A row sums 27 products at most, each of a size up to that of the diagonal.
    let volume = 0.3f64.powi(D as i32);
    let diagonal = mass * volume + stiffness * 4.0 * volume / 0.09;
    let tolerance = 64.0 * f64::EPSILON * diagonal;
    prop_assert!(max_abs_difference(&y, &engine) <= tolerance);
    prop_assert!(max_abs_difference(&y, &assembled) <= tolerance);
    Ok(())
}

fn is_symmetric<const D: usize>(nodes: [usize; D], seed: u64) -> Result<(), TestCaseError> {
    let grid = Grid::with_nodes(nodes, 0.7).unwrap();
    let (x, y) = (noise(grid.n_nodes(), seed), noise(grid.n_nodes(), seed + 1));
    for coefficients in [MASS, STIFFNESS] {
        let (ax, ay) = (
            product(grid, coefficients, &x),
            product(grid, coefficients, &y),
        );
        let scale = vector::norm(&ax) * vector::norm(&y) + vector::norm(&ay) * vector::norm(&x);
        let difference = vector::dot(&ax, &y) - vector::dot(&ay, &x);
        // Rounding of products and sums, far from adding up.
        prop_assert!(difference.abs() <= 1e-14 * scale);
        prop_assert!(vector::dot(&ax, &x) >= -1e-14 * scale);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn applied_and_assembled_agree(
        nodes in prop::array::uniform3(2usize..12),
        mass in 0.0f64..3.0,
        stiffness in 0.0f64..3.0,
        seed in 0u64..1000,
    ) {
        let coefficients = MassStiffness { mass, stiffness };
        agrees_with_its_twins([nodes[0], nodes[1]], coefficients, seed)?;
        agrees_with_its_twins(nodes, coefficients, seed)?;
    }

    #[test]
    fn products_are_symmetric_and_not_negative(
        nodes in prop::array::uniform3(2usize..20),
        seed in 0u64..1000,
    ) {
        is_symmetric([nodes[0], nodes[1]], seed)?;
        is_symmetric(nodes, seed)?;
    }
}

/// Rows longer than a stretch, and several tasks.
#[test]
fn long_rows_agree_with_the_engine() {
    let coefficients = MassStiffness {
        mass: 0.4,
        stiffness: 1.3,
    };
    agrees_with_its_twins([1500, 19], coefficients, 3).unwrap();
    agrees_with_its_twins([41, 37, 5], coefficients, 4).unwrap();
}

#[test]
fn constants_and_volumes() {
    fn check<const D: usize>(nodes: [usize; D]) {
        let grid = Grid::with_nodes(nodes, 0.25).unwrap();
        let ones = vec![1.0; grid.n_nodes()];
        let flux = product(grid, STIFFNESS, &ones);
        let size = 0.25f64.powi(D as i32 - 2);
        assert!(vector::max_abs(&flux) <= 32.0 * f64::EPSILON * size);
        let volume: f64 = grid.extent().iter().product();
        let total = vector::sum(&product(grid, MASS, &ones));
        assert!((total - volume).abs() <= 1e-14 * volume, "{total} {volume}");
        // The Dirichlet energy of a linear function is its slope squared times the volume.
        let linear: Vec<f64> = (0..grid.n_nodes())
            .map(|i| grid.position(grid.node(i)).iter().sum())
            .collect();
        let twice = vector::dot(&linear, &product(grid, STIFFNESS, &linear));
        let exact = D as f64 * volume;
        assert!((twice - exact).abs() <= 1e-13 * exact, "{twice} {exact}");
    }
    check([2, 2]);
    check([33, 20]);
    check([2, 3, 2]);
    check([17, 9, 12]);
}

#[test]
fn components_are_worked_on_alike() {
    let grid = Grid::<3>::cube(6);
    let n = grid.n_nodes();
    let x = noise(3 * n, 8);
    let y = product(grid, STIFFNESS, &x);
    for c in 0..3 {
        let part = c * n..(c + 1) * n;
        assert_eq!(product(grid, STIFFNESS, &x[part.clone()]), y[part]);
    }
}

#[test]
fn single_precision_agrees_to_its_accuracy() {
    let grid = Grid::<3>::cube(20);
    let x = noise(grid.n_nodes(), 5);
    let y = product(grid, STIFFNESS, &x);
    let single: Vec<f32> = x.iter().map(|&x| x as f32).collect();
    let mut out = single.clone();
    UniformOperator::new(grid, STIFFNESS).product_into(&single, &mut out);
    let out: Vec<f64> = out.iter().map(|&y| f64::from(y)).collect();
    // The diagonal is 8/3 h; a few roundings of numbers of that size.
    let tolerance = 16.0 * f64::from(f32::EPSILON) * grid.spacing();
    assert!(max_abs_difference(&out, &y) <= tolerance);
}

#[test]
fn bits_depend_on_neither_threads_nor_instruction_set() {
    fn check<const D: usize>(nodes: [usize; D]) {
        let grid = Grid::with_nodes(nodes, 0.1).unwrap();
        let x = noise(grid.n_nodes(), 2);
        let single: Vec<f32> = x.iter().map(|&x| x as f32).collect();
        let coefficients = MassStiffness {
            mass: 0.7,
            stiffness: 0.2,
        };
        let run = |level, threads| {
            on_threads(threads, || {
                let operator = UniformOperator::new(grid, coefficients).with_simd_level(level);
                let mut y = vec![0.0; x.len()];
                operator.product_into(&x, &mut y);
                let mut z = vec![0f32; x.len()];
                operator.product_into(&single, &mut z);
                let bits: Vec<u64> = y.iter().map(|y| y.to_bits()).collect();
                (bits, z.iter().map(|z| z.to_bits()).collect::<Vec<u32>>())
            })
        };
        let reference = run(SimdLevel::Scalar, 1);
        for level in [SimdLevel::Scalar, SimdLevel::Wide256, SimdLevel::Widest] {
            for threads in [1, 2, 5] {
                assert!(reference == run(level, threads), "{level:?}, {threads}");
            }
        }
    }
    check([150, 130]);
    check([29, 31, 23]);
}
