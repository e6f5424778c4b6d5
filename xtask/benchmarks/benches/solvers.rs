//! Times of the linear solvers: mass and stiffness, exact solves by transforms, a multigrid cycle.

use std::hint::black_box;

use benchmarks::{displacement, nodes, stiffness};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fe_grid::multigrid::{Multigrid, MultigridParams};
use fe_grid::operators::{MassStiffness, WeightedMassStiffness};
use fe_grid::{Boundary, Element, Grid, LinearOperator, SpectralSolver, UniformOperator};

fn uniform_of<T: Element, const D: usize>(c: &mut Criterion, name: &str, n: usize) {
    let grid = Grid::<D>::cube(n);
    let x = &displacement::<T, D>(&grid)[..grid.n_nodes()];
    let mut out = vec![T::default(); x.len()];
    let operator = UniformOperator::new(
        grid,
        MassStiffness {
            mass: 1.0,
            stiffness: 0.1,
        },
    );
    let mut group = c.benchmark_group(format!("uniform/{D}D/{name}"));
    group.throughput(Throughput::Elements(grid.n_nodes() as u64));
    group.bench_function(BenchmarkId::new("product", n), |b| {
        b.iter(|| operator.product_into(black_box(x), &mut out));
    });
}

fn uniform(c: &mut Criterion) {
    uniform_of::<f64, 2>(c, "f64", nodes(1025, 17));
    uniform_of::<f32, 2>(c, "f32", nodes(1025, 17));
    uniform_of::<f64, 3>(c, "f64", nodes(129, 7));
    uniform_of::<f32, 3>(c, "f32", nodes(129, 7));
}

fn spectral_of<const D: usize>(c: &mut Criterion, n: usize) {
    let grid = Grid::<D>::cube(n);
    let rhs = &displacement::<f64, D>(&grid)[..grid.n_nodes()];
    let mut out = vec![0.0; rhs.len()];
    let mut group = c.benchmark_group(format!("spectral/{D}D"));
    group.throughput(Throughput::Elements(grid.n_nodes() as u64));
    for (name, boundary) in [
        ("natural", Boundary::Natural),
        ("dirichlet", Boundary::Dirichlet),
    ] {
        let solver = SpectralSolver::new(grid, 1.0, 0.1, boundary).expect("definite with a mass");
        group.bench_function(BenchmarkId::new(name, n), |b| {
            b.iter(|| solver.solve_into(black_box(rhs), &mut out));
        });
    }
}

fn spectral(c: &mut Criterion) {
    spectral_of::<2>(c, nodes(257, 9));
    spectral_of::<3>(c, nodes(65, 5));
}

/// Vector data with a stiffness that jumps by four orders of magnitude, in single precision.
fn multigrid_of<const D: usize>(c: &mut Criterion, n: usize) {
    let grid = Grid::<D>::cube(n);
    let h = grid.spacing();
    let centre = |i: usize| grid.position(grid.cell(i)).map(|x| x + 0.5 * h);
    let kappa: Vec<f32> = (0..grid.n_cells())
        .map(|i| stiffness(centre(i)) as f32)
        .collect();
    let mass = vec![1e-4; kappa.len()];
    let build = || {
        let cells = vec![mass.clone(), kappa.clone()];
        let params = MultigridParams::default();
        Multigrid::<f32, _, D, D>::new(grid, &WeightedMassStiffness, cells, params)
            .expect("definite with a mass")
    };
    let cycle = build();
    let rhs = displacement::<f64, D>(&grid);
    let mut out = vec![0.0; rhs.len()];
    let mut group = c.benchmark_group(format!("multigrid/{D}D"));
    group.throughput(Throughput::Elements(rhs.len() as u64));
    group.sample_size(20);
    group.bench_function(BenchmarkId::new("build", n), |b| b.iter(build));
    group.bench_function(BenchmarkId::new("cycle", n), |b| {
        b.iter(|| cycle.apply_into(black_box(&rhs), &mut out));
    });
}

fn multigrid(c: &mut Criterion) {
    multigrid_of::<2>(c, nodes(257, 17));
    multigrid_of::<3>(c, nodes(65, 9));
}

criterion_group!(solvers, uniform, spectral, multigrid);
criterion_main!(solvers);
