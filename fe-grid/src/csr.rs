//! Assembled matrices: twins of the applied operators, for tests and coarse grids.

use nalgebra_sparse::{CooMatrix, CsrMatrix};

use crate::grid::Grid;
use crate::linear::LinearOperator;

/// The mass matrix `M_ab = ∫ N_a N_b` of multilinear elements.
pub fn mass_matrix<const D: usize>(grid: &Grid<D>) -> CsrMatrix<f64> {
    weighted_mass_matrix(grid, |_, _| 1.0)
}

/// The stiffness matrix `L_ab = ∫ ∇N_a · ∇N_b` of multilinear elements.
pub fn stiffness_matrix<const D: usize>(grid: &Grid<D>) -> CsrMatrix<f64> {
    weighted_stiffness_matrix(grid, |_, _| 1.0)
}

/// `M[ω]_ab = Σ_q w ω(x_q) N_a(x_q) N_b(x_q)` by the rule of two Gauss points an axis; `omega`
/// takes the place of the cell in memory and that of the point in the cell (bit `k` set: upper
/// point along axis `k`).
pub fn weighted_mass_matrix<const D: usize>(
    grid: &Grid<D>,
    omega: impl Fn(usize, usize) -> f64,
) -> CsrMatrix<f64> {
    assemble(grid, omega, |point, a, b| {
        basis(point, a, None) * basis(point, b, None)
    })
}

/// `L[ω]_ab = Σ_q w ω(x_q) ∇N_a(x_q) · ∇N_b(x_q)`; see [`weighted_mass_matrix`].
pub fn weighted_stiffness_matrix<const D: usize>(
    grid: &Grid<D>,
    omega: impl Fn(usize, usize) -> f64,
) -> CsrMatrix<f64> {
    let scale = grid.spacing().powi(-2);
    assemble(grid, omega, |point, a, b| {
        let product = |k| basis(point, a, Some(k)) * basis(point, b, Some(k));
        scale * (0..D).map(product).sum::<f64>()
    })
}

/// An assembled matrix as an applied operator.
#[derive(Clone, Debug)]
pub struct CsrOperator(pub CsrMatrix<f64>);

impl LinearOperator for CsrOperator {
    fn dim(&self) -> usize {
        self.0.nrows()
    }
    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        assert_eq!((x.len(), y.len()), (self.0.ncols(), self.0.nrows()));
        for (out, row) in y.iter_mut().zip(self.0.row_iter()) {
            let terms = row.col_indices().iter().zip(row.values());
            *out = terms.map(|(&column, value)| value * x[column]).sum();
        }
    }
}

/// Sums `w ω(x_q) product(x_q, a, b)` over all points of all cells into the places of the nodes
/// at corners `a` and `b`.
fn assemble<const D: usize>(
    grid: &Grid<D>,
    omega: impl Fn(usize, usize) -> f64,
    product: impl Fn([f64; D], usize, usize) -> f64,
) -> CsrMatrix<f64> {
    let corners = 1usize << D;
    let weight = grid.cell_volume() / corners as f64;
    let local: Vec<f64> = (0..corners * corners * corners)
        .map(|i| {
            let (q, a, b) = (i / (corners * corners), i / corners % corners, i % corners);
            weight * product(gauss_point(q), a, b)
        })
        .collect();
    let n = grid.n_nodes();
    let mut triplets = CooMatrix::new(n, n);
    for cell in 0..grid.n_cells() {
        let nodes: Vec<usize> = corner_nodes(grid, cell);
        let weights: Vec<f64> = (0..corners).map(|q| omega(cell, q)).collect();
        for a in 0..corners {
            for b in 0..corners {
                let term = |q: usize| weights[q] * local[(q * corners + a) * corners + b];
                triplets.push(nodes[a], nodes[b], (0..corners).map(term).sum());
            }
        }
    }
    CsrMatrix::from(&triplets)
}

fn corner_nodes<const D: usize>(grid: &Grid<D>, cell: usize) -> Vec<usize> {
    let first = grid.node_index(grid.cell(cell));
    let strides = grid.strides();
    let offset = |corner: usize| -> usize { (0..D).map(|k| (corner >> k & 1) * strides[k]).sum() };
    (0..1 << D).map(|corner| first + offset(corner)).collect()
}

/// The Gauss point `q` of the unit cell.
fn gauss_point<const D: usize>(q: usize) -> [f64; D] {
    let shift = 0.5 / 3.0f64.sqrt();
    std::array::from_fn(|k| 0.5 + if q >> k & 1 == 1 { shift } else { -shift })
}

/// The multilinear function of a corner of the unit cell at a point, or its derivative along an
/// axis.
fn basis<const D: usize>(point: [f64; D], corner: usize, derivative: Option<usize>) -> f64 {
    let factor = |k: usize| {
        let upper = corner >> k & 1 == 1;
        match (derivative == Some(k), upper) {
            (true, true) => 1.0,
            (true, false) => -1.0,
            (false, true) => point[k],
            (false, false) => 1.0 - point[k],
        }
    };
    (0..D).map(factor).product()
}
