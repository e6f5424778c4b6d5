//! Shapes for the tests, and slow reference computations.

use fe_grid::random::SplitMix64;
use fe_grid::{Field, Grid};
use levelset::Contour;

/// The signed distance of a ball about the middle of the box.
pub fn ball<const D: usize>(grid: Grid<D>, radius: f64) -> Field<f64, D, 1> {
    let middle = grid.extent().map(|l| l / 2.0);
    Field::from_fn(grid, |x| {
        let r2: f64 = (0..D).map(|k| (x[k] - middle[k]).powi(2)).sum();
        [radius - r2.sqrt()]
    })
}

/// A ball with bumps.
pub fn bumpy<const D: usize>(grid: Grid<D>) -> Field<f64, D, 1> {
    Field::from_fn(grid, |x| {
        let r2: f64 = x.iter().map(|t| (t - 0.5).powi(2)).sum();
        let bumps: f64 = x.iter().map(|t| (17.0 * t).sin()).product();
        [0.3 + 0.05 * bumps - r2.sqrt()]
    })
}

/// The tube of a torus about the z axis.
pub fn torus(grid: Grid<3>) -> Field<f64, 3, 1> {
    Field::from_fn(grid, |[x, y, z]| {
        let ring = (x - 0.5).hypot(y - 0.5) - 0.3;
        [0.12 - ring.hypot(z - 0.5)]
    })
}

/// Independent values in (-1/2, 1/2) at every node: every configuration of cells occurs.
pub fn noise<const D: usize>(n_nodes: [usize; D], seed: u64) -> Field<f64, D, 1> {
    let mut random = SplitMix64::new(seed);
    let grid = Grid::with_nodes(n_nodes, 0.2).unwrap();
    let data = (0..grid.n_nodes())
        .map(|_| random.between(-0.5, 0.5))
        .collect();
    Field::from_vec(grid, data).unwrap()
}

/// Distance to a contour by minimising over a fine list of candidates: all simplices, each by
/// its own plane and edges.
pub fn brute_force<const D: usize>(contour: &Contour<D>, p: [f64; D]) -> f64 {
    contour
        .all_corners()
        .map(|c| to_simplex(&c, &p))
        .fold(f64::INFINITY, f64::min)
}

fn to_simplex<const D: usize>(c: &[[f64; D]; D], p: &[f64; D]) -> f64 {
    let mut best = f64::INFINITY;
    for i in 0..D {
        for j in 0..i {
            best = best.min(to_segment(&c[i], &c[j], p));
        }
    }
    if D == 3 {
        best = best.min(to_interior(c, p));
    }
    best
}

fn to_segment<const D: usize>(a: &[f64; D], b: &[f64; D], p: &[f64; D]) -> f64 {
    let dot = |u: &dyn Fn(usize) -> f64, v: &dyn Fn(usize) -> f64| -> f64 {
        (0..D).map(|k| u(k) * v(k)).sum()
    };
    let edge = |k: usize| b[k] - a[k];
    let ray = |k: usize| p[k] - a[k];
    let length = dot(&edge, &edge);
    let s = if length > 0.0 {
        (dot(&edge, &ray) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let rest = |k: usize| ray(k) - s * edge(k);
    dot(&rest, &rest).sqrt()
}

/// Distance to the plane where the foot lies in the triangle, by normal equations.
fn to_interior<const D: usize>(c: &[[f64; D]; D], p: &[f64; D]) -> f64 {
    let sub = |a: &[f64; D], b: &[f64; D]| -> [f64; D] { std::array::from_fn(|k| a[k] - b[k]) };
    let dot = |a: &[f64; D], b: &[f64; D]| -> f64 { (0..D).map(|k| a[k] * b[k]).sum() };
    let (u, v, r) = (sub(&c[1], &c[0]), sub(&c[2], &c[0]), sub(p, &c[0]));
    let (uu, uv, vv) = (dot(&u, &u), dot(&u, &v), dot(&v, &v));
    let (ru, rv) = (dot(&r, &u), dot(&r, &v));
    let det = uu * vv - uv * uv;
    let (s, t) = ((ru * vv - rv * uv) / det, (rv * uu - ru * uv) / det);
    if !(s >= 0.0 && t >= 0.0 && s + t <= 1.0) {
        return f64::INFINITY;
    }
    let rest: [f64; D] = std::array::from_fn(|k| r[k] - s * u[k] - t * v[k]);
    dot(&rest, &rest).sqrt()
}
