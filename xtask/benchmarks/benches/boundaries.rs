//! Times of the Hausdorff distance of two boundaries of 4,700 points, beside a plain double loop over the
//! points, which has no points between corners and no percentile.

use std::hint::black_box;

use benchmarks::nodes;
use criterion::{Criterion, criterion_group, criterion_main};
use fe_grid::{Field, Grid};
use levelset::contour::Contour;
use levelset::{BoxEdge, contour, hausdorff};

/// The surface of a body `radius(direction)`, from samples on `n` nodes a side.
fn surface<const D: usize>(
    n: usize,
    centre: [f64; D],
    radius: impl Fn([f64; D]) -> f64 + Sync,
) -> Contour<D> {
    let field = Field::<f64, D, 1>::from_fn(Grid::cube(n), |x| {
        let ray: [f64; D] = std::array::from_fn(|k| x[k] - centre[k]);
        let length = ray.iter().map(|r| r * r).sum::<f64>().sqrt();
        [radius(ray.map(|r| r / length.max(1e-9))) - length]
    });
    contour(&field, 0.0, BoxEdge::Open).expect("the body lies in the box")
}

/// The largest distance of the points of either boundary from the nearest point of the other.
fn double_loop<const D: usize>(a: &Contour<D>, b: &Contour<D>) -> f64 {
    let directed = |from: &Contour<D>, to: &Contour<D>| {
        let nearest = |p: &[f64; D]| {
            let squares = to
                .points()
                .iter()
                .map(|q| (0..D).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>());
            squares.fold(f64::INFINITY, f64::min)
        };
        from.points().iter().map(nearest).fold(0.0, f64::max)
    };
    directed(a, b).max(directed(b, a)).sqrt()
}

fn pair<const D: usize>(c: &mut Criterion, name: &str, a: &Contour<D>, b: &Contour<D>) {
    let mut group = c.benchmark_group(format!("hausdorff/{D}D/{name}"));
    group.sample_size(10);
    let points = format!("{} and {} points", a.points().len(), b.points().len());
    group.bench_function(&points, |bench| bench.iter(|| hausdorff(black_box(a), b)));
    group.bench_function(format!("{points}, double loop"), |bench| {
        bench.iter(|| double_loop(black_box(a), b));
    });
}

fn boundaries(c: &mut Criterion) {
    let (flat, solid) = (nodes(1501, 65), nodes(51, 17));
    let (middle, aside) = ([0.5; 2], [0.52, 0.51]);
    let bumpy = |[x, y]: [f64; 2]| 0.36 + 0.03 * (8.0 * y.atan2(x)).cos();
    let disk = surface::<2>(flat, middle, |_| 0.36);
    pair(c, "bumpy", &disk, &surface(flat, aside, bumpy));
    // Every point is a candidate for the farthest.
    pair(c, "concentric", &disk, &surface(flat, middle, |_| 0.40));
    let (middle, aside) = ([0.5; 3], [0.52, 0.51, 0.5]);
    let bumpy = |[x, y, z]: [f64; 3]| 0.30 + 0.2 * x * y * z;
    let ball = surface::<3>(solid, middle, |_| 0.32);
    pair(c, "bumpy", &ball, &surface(solid, aside, bumpy));
    pair(c, "concentric", &ball, &surface(solid, middle, |_| 0.35));
}

criterion_group!(benches, boundaries);
criterion_main!(benches);
