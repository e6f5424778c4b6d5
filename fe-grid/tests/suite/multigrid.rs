//! Multigrid with coefficients that jump: symmetric, and as good on fine grids as on coarse.

use crate::support::noise;
use fe_grid::multigrid::{Multigrid, MultigridParams};
use fe_grid::operators::WeightedMassStiffness;
use fe_grid::{CgParams, CgScratch, Element, Grid, LinearOperator, conjugate_gradient};

/// Stiffness 1 inside a ball, `contrast` outside, with a mass that keeps the constants bounded.
fn cells<T: Element, const D: usize>(grid: &Grid<D>, contrast: f64) -> Vec<Vec<T>> {
    let h = grid.spacing();
    let stiffness = (0..grid.n_cells()).map(|i| {
        let r: f64 = grid
            .cell(i)
            .iter()
            .map(|&c| ((c as f64 + 0.5) * h - 0.5).powi(2))
            .sum();
        if r.sqrt() < 0.31 { 1.0 } else { contrast }
    });
    let stiffness: Vec<f64> = stiffness.collect();
    let mass = stiffness.iter().map(|_| T::from_f64(contrast)).collect();
    vec![mass, stiffness.iter().map(|&s| T::from_f64(s)).collect()]
}

struct Operator<'a, const D: usize>(&'a Multigrid<f64, WeightedMassStiffness, D, 1>, usize);

impl<const D: usize> LinearOperator for Operator<'_, D> {
    fn dim(&self) -> usize {
        self.1
    }
    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        self.0.operator_into(x, y);
    }
}

fn iterations<T: Element, const D: usize>(n: usize, contrast: f64) -> usize {
    let grid = Grid::<D>::cube(n);
    let params = MultigridParams::default();
    let law = WeightedMassStiffness;
    let exact = Multigrid::<f64, _, D, 1>::new(grid, &law, cells(&grid, contrast), params).unwrap();
    let cycle = Multigrid::<T, _, D, 1>::new(grid, &law, cells(&grid, contrast), params).unwrap();
    let operator = Operator(&exact, grid.n_nodes());
    let b = noise(grid.n_nodes(), 1);
    let mut x = vec![0.0; b.len()];
    let params = CgParams {
        relative_tolerance: 1e-8,
        max_iterations: 200,
        ..CgParams::default()
    };
    let mut scratch = CgScratch::default();
    let info = conjugate_gradient(&operator, &cycle, &b, &mut x, &params, &mut scratch).unwrap();
    let mut ax = vec![0.0; b.len()];
    operator.apply_into(&x, &mut ax);
    let residual: f64 = ax
        .iter()
        .zip(&b)
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>()
        .sqrt();
    assert!(
        residual <= 1.1e-8 * b.iter().map(|x| x * x).sum::<f64>().sqrt(),
        "{residual}"
    );
    info.iterations
}

#[test]
fn iterations_do_not_grow_with_the_grid() {
    let plane: Vec<usize> = [17, 33, 65, 129]
        .map(|n| iterations::<f64, 2>(n, 1e-4))
        .to_vec();
    let space: Vec<usize> = [9, 17, 33].map(|n| iterations::<f64, 3>(n, 1e-4)).to_vec();
    // A jump of 1e4 that no coarse grid resolves costs some iterations; they must stay bounded.
    println!("{plane:?} {space:?}");
    assert!(plane.iter().all(|&n| n <= 20), "{plane:?}");
    assert!(space.iter().all(|&n| n <= 22), "{space:?}");
    // Single precision inside the preconditioner costs next to nothing.
    assert!(iterations::<f32, 2>(129, 1e-4) <= plane[3] + 2);
}

#[test]
fn cycle_is_symmetric_and_definite() {
    let grid = Grid::<2>::with_nodes([33, 17], 1.0 / 32.0).unwrap();
    let cycle = Multigrid::<f64, _, 2, 1>::new(
        grid,
        &WeightedMassStiffness,
        cells(&grid, 1e-2),
        MultigridParams::default(),
    )
    .unwrap();
    let (x, y) = (noise(cycle.dim(), 1), noise(cycle.dim(), 2));
    let (mut px, mut py) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    cycle.apply_into(&x, &mut px);
    cycle.apply_into(&y, &mut py);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    assert!((dot(&px, &y) - dot(&x, &py)).abs() < 1e-10 * dot(&px, &x));
    assert!(dot(&px, &x) > 0.0);
}
