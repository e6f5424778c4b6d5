//! Multigrid with coefficients that jump: symmetric, and as good on fine grids as on coarse.

use fe_grid::multigrid::{CoefficientLaw, Multigrid, MultigridParams};
use fe_grid::operators::WeightedMassStiffness;
use fe_grid::random::noise;
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
    iterations_on::<T, D>(Grid::cube(n), contrast)
}

fn iterations_on<T: Element, const D: usize>(grid: Grid<D>, contrast: f64) -> usize {
    iterations_with::<T, D>(grid, contrast, MultigridParams::default())
}

fn iterations_with<T: Element, const D: usize>(
    grid: Grid<D>,
    contrast: f64,
    params: MultigridParams,
) -> usize {
    let law = WeightedMassStiffness;
    let usual = MultigridParams::default();
    let exact = Multigrid::<f64, _, D, 1>::new(grid, &law, cells(&grid, contrast), usual).unwrap();
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
    // Single precision inside the preconditioner costs next to nothing, and so do halves.
    assert!(iterations::<f32, 2>(129, 1e-4) <= plane[3] + 2);
    let halves = MultigridParams {
        in_halves: true,
        ..MultigridParams::default()
    };
    assert!(iterations_with::<f32, 2>(Grid::cube(129), 1e-4, halves) <= plane[3] + 2);
    assert!(iterations_with::<f32, 3>(Grid::cube(17), 1e-4, halves) <= space[1] + 2);
}

/// Numbers of cells that are odd on some level, along one axis and along all, and long boxes.
#[test]
fn boxes_of_any_sides_take_as_many_iterations_as_cubes() {
    let plane = |sides: [usize; 2]| {
        let longest = (sides[0].max(sides[1]) - 1) as f64;
        iterations_on::<f64, 2>(Grid::with_nodes(sides, longest.recip()).unwrap(), 1e-4)
    };
    let plane = [[65, 23], [50, 50], [97, 97], [129, 17], [62, 20]].map(plane);
    let space = |sides: [usize; 3]| {
        let longest = sides.into_iter().max().unwrap() as f64 - 1.0;
        iterations_on::<f64, 3>(Grid::with_nodes(sides, longest.recip()).unwrap(), 1e-4)
    };
    let space = [[33, 15, 13], [20, 20, 20], [49, 9, 9], [26, 33, 19]].map(space);
    println!("{plane:?} {space:?}");
    // The bounds of cubes.
    assert!(plane.iter().all(|&n| n <= 20), "{plane:?}");
    assert!(space.iter().all(|&n| n <= 22), "{space:?}");
}

#[test]
fn cycle_is_symmetric_and_definite() {
    check_symmetry(Grid::with_nodes([33, 17], 1.0 / 32.0).unwrap());
    check_symmetry(Grid::with_nodes([36, 14], 1.0 / 35.0).unwrap());
}

fn check_symmetry(grid: Grid<2>) {
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

/// Coefficients of many sizes, side by side: no vector has more energy than the bound allows, and where
/// all cells are alike one has as much.
fn check_bound<const D: usize>(n: usize) {
    let grid = Grid::<D>::cube(n);
    let wild = |seed: u64| -> Vec<f64> {
        let exponents = noise(grid.n_cells(), seed);
        exponents.iter().map(|e| 10f64.powf(4.0 * e)).collect()
    };
    let uniform = |value: f64| vec![value; grid.n_cells()];
    let alternating: Vec<f64> = (0..grid.n_nodes())
        .map(|i| {
            let odd = grid.node(i).iter().sum::<usize>() % 2;
            1.0 - 2.0 * odd as f64
        })
        .collect();
    let constant = vec![1.0; grid.n_nodes()];
    let quotients = |cells: &Vec<Vec<f64>>| -> Vec<f64> {
        let params = MultigridParams::default();
        let law = WeightedMassStiffness;
        let cycle = Multigrid::<f64, _, D, 1>::new(grid, &law, cells.clone(), params).unwrap();
        let apply = |x: &[f64]| {
            let mut y = vec![0.0; x.len()];
            cycle.operator_into(x, &mut y);
            y
        };
        let diagonal: Vec<f64> = (0..grid.n_nodes())
            .map(|i| {
                let mut unit = vec![0.0; grid.n_nodes()];
                unit[i] = 1.0;
                apply(&unit)[i]
            })
            .collect();
        let mut vectors: Vec<Vec<f64>> = (0..20).map(|seed| noise(grid.n_nodes(), seed)).collect();
        vectors.extend([alternating.clone(), constant.clone()]);
        let quotient = |x: &Vec<f64>| {
            let energy: f64 = apply(x).iter().zip(x).map(|(a, b)| a * b).sum();
            let of_diagonal: f64 = diagonal.iter().zip(x).map(|(d, x)| d * x * x).sum();
            energy / of_diagonal
        };
        vectors.iter().map(quotient).collect()
    };
    let bound = |cells: &Vec<Vec<f64>>| {
        let law = WeightedMassStiffness;
        let cells: Vec<_> = cells.iter().map(|data| data.as_slice().into()).collect();
        CoefficientLaw::<D, 1>::spectral_bound(&law, grid.spacing(), &cells).unwrap()
    };
    for seed in 0..5 {
        let cells = vec![wild(seed), wild(seed + 100)];
        let (found, bound) = (quotients(&cells), bound(&cells));
        // Up to rounding.
        let largest = bound * (1.0 + 1e-12);
        assert!(found.iter().all(|q| *q <= largest), "{found:?} {bound}");
    }
    // Mass alone: a constant has (3/2)^D times the energy of its values by themselves.
    let cells = vec![uniform(2.0), uniform(0.0)];
    let mass = 1.5f64.powi(D as i32);
    let largest = quotients(&cells).into_iter().fold(0.0, f64::max);
    assert!((bound(&cells) - mass).abs() < 1e-12 && (largest - mass).abs() < 1e-12);
    // Stiffness alone: 3/2 of what alternates along one axis, in two dimensions and more.
    let cells = vec![uniform(0.0), uniform(3.0)];
    assert!((bound(&cells) - 1.5).abs() < 1e-12);
}

#[test]
fn spectra_stay_below_their_bounds() {
    check_bound::<2>(9);
    check_bound::<3>(5);
}

/// Where stiffness vanishes in a part only, the coarse levels do not see how wide the spectrum of the
/// fine one is: the cycle has to stay definite on what alternates there.
#[test]
fn a_cycle_is_definite_where_stiffness_vanishes_in_a_part() {
    let grid = Grid::<3>::cube(17);
    let inside = |cell: usize| grid.cell(cell).iter().all(|i| (5..9).contains(i));
    let stiffness = (0..grid.n_cells())
        .map(|cell| if inside(cell) { 1e-9 } else { 1.0 })
        .collect();
    let cells: Vec<Vec<f64>> = vec![vec![10.0; grid.n_cells()], stiffness];
    let params = MultigridParams::default();
    let law = WeightedMassStiffness;
    let cycle = Multigrid::<f64, _, 3, 1>::new(grid, &law, cells, params).unwrap();
    for seed in 0..10 {
        let weights = noise(grid.n_nodes(), seed);
        let r: Vec<f64> = (0..grid.n_nodes())
            .map(|i| {
                let near = grid.node(i).iter().all(|k| (6..9).contains(k));
                if near { 1.0 + 0.2 * weights[i] } else { 0.0 }
            })
            .collect();
        let mut z = vec![0.0; r.len()];
        cycle.apply_into(&r, &mut z);
        let product: f64 = r.iter().zip(&z).map(|(a, b)| a * b).sum();
        assert!(product > 0.0, "{product}");
    }
}
