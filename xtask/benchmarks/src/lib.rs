//! A law, states and sizes for the benchmarks of the grids and the solvers on them.

#![forbid(unsafe_code)]

use fe_grid::{CellLaw, Element, Grid, Jet, Lane, Point, Reads, tensor};

/// The measured size, or a small one if the benchmarks run as tests.
pub fn nodes(measured: usize, tested: usize) -> usize {
    if std::env::args().any(|argument| argument == "--bench") {
        measured
    } else {
        tested
    }
}

/// `kappa (mu/2 (|A|^2 - d) + lambda/4 (det^2 - 1) - (mu + lambda/2) ln det)` with
/// `lambda = mu = 1`, `A = 1 + Du`: a compressible solid with a stiffness at the nodes.
#[derive(Clone, Copy)]
pub struct Solid;

impl Reads for Solid {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellLaw<D, D> for Solid {
    #[inline(always)]
    fn value<L: Lane>(&self, p: &Point<L, D, D>) -> L {
        let excess = tensor::determinant_excess(&p.gradient);
        let volume =
            excess.mul_add(excess, excess + excess).scale(0.25) - excess.ln_1p().scale(1.5);
        let norm = tensor::squared_norm_excess(&p.gradient).scale(0.5);
        (norm + volume) * p.coefficient[0]
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, p: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let a = tensor::add_identity(&p.gradient);
        let cofactor = tensor::cofactor(&a);
        let det = tensor::determinant_with(&a, &cofactor);
        let slope = det.scale(0.5) - L::splat(1.5) / det;
        let stress = tensor::add_scaled(&a, slope, &cofactor);
        let jet = Jet {
            value: [L::zero(); D],
            gradient: tensor::scale(&stress, p.coefficient[0]),
        };
        (self.value(p), jet)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(&self, p: &Point<L, D, D>, d: &Jet<L, D, D>) -> Jet<L, D, D> {
        let a = tensor::add_identity(&p.gradient);
        let cofactor = tensor::cofactor(&a);
        let inverse = L::one() / tensor::determinant_with(&a, &cofactor);
        let det = L::one() / inverse;
        let slope = det.scale(0.5) - inverse.scale(1.5);
        let curvature = (inverse * inverse).mul_add(L::splat(1.5), L::splat(0.5));
        let along = curvature * tensor::contract(&cofactor, &d.gradient);
        let turned = tensor::cofactor_derivative(&a, &d.gradient);
        let change = tensor::add_scaled(&d.gradient, slope, &turned);
        let change = tensor::add_scaled(&change, along, &cofactor);
        Jet {
            value: [L::zero(); D],
            gradient: tensor::scale(&change, p.coefficient[0]),
        }
    }
}

/// A smooth displacement that does not fold, `.01 sin(...)` in each component.
pub fn displacement<T: Element, const D: usize>(grid: &Grid<D>) -> Vec<T> {
    let n = grid.n_nodes();
    let wave = |i: usize| {
        let x = grid.position(grid.node(i % n));
        let phase: f64 = (0..D).map(|k| (k + 1 + i / n) as f64 * x[k]).sum();
        T::from_f64(0.01 * (4.0 * phase).sin())
    };
    (0..D * n).map(wave).collect()
}

/// A field between a small number and one: stiff inside a ball, soft outside.
pub fn stiffness<const D: usize>(x: [f64; D]) -> f64 {
    let squared: f64 = x.iter().map(|x| (x - 0.5).powi(2)).sum();
    if squared < 0.09 { 1.0 } else { 1e-4 }
}
