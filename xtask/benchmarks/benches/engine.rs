//! Times of the cell engine: an elastic energy, a composition, normal equations, stencils.

use std::hint::black_box;

use benchmarks::{Solid, displacement, nodes, stiffness};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fe_grid::composition::{Interpolant, MatchDensity, Matching};
use fe_grid::engine::MAX_COEFFICIENTS;
use fe_grid::scatter::{PointWeights, Source, normal_equations};
use fe_grid::stencil::Background;
use fe_grid::{Assembly, Data, Element, Field, Grid, Lane, LinearOperator, Point, Reads, certify};

/// Quadrature points, `2^D` per cell.
fn points<const D: usize>(grid: &Grid<D>) -> Throughput {
    Throughput::Elements((grid.n_cells() << D) as u64)
}

fn stiffness_field<T: Element, const D: usize>(grid: Grid<D>) -> Vec<T> {
    Field::<T, D, 1>::from_fn(grid, |x| [stiffness(x)]).into_vec()
}

fn elastic_of<T: Element, const D: usize>(c: &mut Criterion, name: &str, n: usize) {
    let grid = Grid::<D>::cube(n);
    let kappa = stiffness_field::<T, D>(grid);
    let coefficients = [kappa.as_slice()];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let assembly = Assembly::new(grid, &Solid, data);
    let state = displacement::<T, D>(&grid);
    let mut out = vec![T::default(); state.len()];
    assert!(assembly.value(&state).is_ok(), "the state folds over");
    let mut group = c.benchmark_group(format!("elastic/{D}D/{name}"));
    group.throughput(points(&grid));
    group.bench_function(BenchmarkId::new("value", n), |b| {
        b.iter(|| assembly.value(black_box(&state)));
    });
    group.bench_function(BenchmarkId::new("value_and_gradient", n), |b| {
        b.iter(|| assembly.value_and_gradient_into(black_box(&state), &mut out));
    });
    group.bench_function(BenchmarkId::new("hessian_action", n), |b| {
        b.iter(|| assembly.hessian_action_into(black_box(&state), &state, &mut out));
    });
    group.bench_function(BenchmarkId::new("certificate", n), |b| {
        b.iter(|| certify(&grid, black_box(&state), 0.0));
    });
}

fn elastic(c: &mut Criterion) {
    let (flat, solid) = (nodes(513, 17), nodes(65, 7));
    elastic_of::<f64, 2>(c, "f64", flat);
    elastic_of::<f32, 2>(c, "f32", flat);
    elastic_of::<f64, 3>(c, "f64", solid);
    elastic_of::<f32, 3>(c, "f32", solid);
}

/// `(s - c)^2 / 2`, and weights of one for the normal equations that belong to it.
struct Square;

impl MatchDensity for Square {
    const COEFFICIENTS: usize = 1;
    #[inline(always)]
    fn value<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> L {
        let excess = s - coefficient[0];
        (excess * excess).scale(0.5)
    }
    #[inline(always)]
    fn derivatives<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> (L, L, L) {
        let excess = s - coefficient[0];
        ((excess * excess).scale(0.5), excess, L::one())
    }
}

impl Reads for Square {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> PointWeights<D> for Square {
    #[inline(always)]
    fn weights<L: Lane>(&self, point: &Point<L, D, D>, _deformed: &[L; D]) -> (L, L) {
        (L::one(), point.coefficient[0])
    }
}

fn composition_of<const D: usize>(c: &mut Criterion, n: usize) {
    let grid = Grid::<D>::cube(n);
    let field = stiffness_field::<f64, D>(grid);
    let coefficients = [field.as_slice()];
    let state = displacement::<f64, D>(&grid);
    let law = Matching::new(Square, Interpolant::new(grid, &field));
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let assembly = Assembly::new(grid, &law, data);
    let mut out = vec![0.0; state.len()];
    let source = Source {
        displacement: &state,
        coefficients: &coefficients,
        weight: 1.0,
    };
    let background = Background {
        mass: 0.0,
        stiffness: 1e-4,
        load: 0.0,
    };
    let mut group = c.benchmark_group(format!("composition/{D}D"));
    group.throughput(points(&grid));
    group.bench_function(BenchmarkId::new("value_and_gradient", n), |b| {
        b.iter(|| assembly.value_and_gradient_into(black_box(&state), &mut out));
    });
    group.bench_function(BenchmarkId::new("normal_equations", n), |b| {
        b.iter(|| normal_equations(&grid, &Square, black_box(&[source]), background));
    });
    group.finish();

    let (matrix, x) = normal_equations(&grid, &Square, &[source], background);
    let mut y = vec![0.0; x.len()];
    let mut group = c.benchmark_group(format!("stencil/{D}D"));
    group.throughput(Throughput::Elements(grid.n_nodes() as u64));
    group.bench_function(BenchmarkId::new("apply", n), |b| {
        b.iter(|| matrix.apply_into(black_box(&x), &mut y));
    });
}

fn composition(c: &mut Criterion) {
    composition_of::<2>(c, nodes(513, 17));
    composition_of::<3>(c, nodes(65, 7));
}

criterion_group!(engine, elastic, composition);
criterion_main!(engine);
