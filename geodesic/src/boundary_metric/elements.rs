//! The stiffness of cut cells: one matrix each.

use super::cut::ObjectCells;
use super::shape::{corner_gradients, offset};
use hyperelastic::LameModuli;

/// The matrices of all cut cells.
#[derive(Clone, Debug)]
pub(super) struct CutElements<const D: usize> {
    strides: [usize; D],
    nodes: usize,
    /// The first node of each cell.
    first: Vec<usize>,
    /// Its matrix, row by row; the unknowns of a corner follow each other.
    matrices: Vec<f64>,
}

impl<const D: usize> CutElements<D> {
    /// Unknowns of a cell.
    const UNKNOWNS: usize = D << D;

    /// The matrices of `int sigma(v) : e(w)` over the occupied parts of cut cells.
    pub fn new(cells: &ObjectCells<D>, moduli: LameModuli) -> Self {
        let (grid, n) = (cells.grid, Self::UNKNOWNS);
        let mut matrices = vec![0.0; cells.cut.len() * n * n];
        for ((_, points), matrix) in cells.cut.iter().zip(matrices.chunks_exact_mut(n * n)) {
            for point in points {
                let gradients = corner_gradients(&point.local, grid.spacing());
                let weight = point.weight * grid.cell_volume();
                add_point::<D>(&gradients, weight, moduli, matrix);
            }
        }
        let first = cells.cut.iter();
        Self {
            strides: grid.strides(),
            nodes: grid.n_nodes(),
            first: first
                .map(|(cell, _)| grid.node_index(grid.cell(*cell)))
                .collect(),
            matrices,
        }
    }

    /// Adds the product of the matrices with a nodal velocity.
    pub fn add_product(&self, x: &[f64], y: &mut [f64]) {
        let n = Self::UNKNOWNS;
        let mut values = [0.0; 24];
        for (first, matrix) in self.first.iter().zip(self.matrices.chunks_exact(n * n)) {
            let place = |u: usize| u % D * self.nodes + first + offset(&self.strides, u / D);
            for (u, value) in values[..n].iter_mut().enumerate() {
                *value = x[place(u)];
            }
            for (u, row) in matrix.chunks_exact(n).enumerate() {
                let sum: f64 = row.iter().zip(&values).map(|(a, x)| a * x).sum();
                y[place(u)] += sum;
            }
        }
    }
}

/// Adds `lambda div v div w + 2 mu e[v] : e[w]` of a point.
fn add_point<const D: usize>(
    gradients: &[[f64; D]; 8],
    weight: f64,
    moduli: LameModuli,
    matrix: &mut [f64],
) {
    let (lambda, mu) = (weight * moduli.lambda, weight * moduli.mu);
    let n = D << D;
    for c in 0..1 << D {
        for d in 0..1 << D {
            let (a, b) = (&gradients[c], &gradients[d]);
            let product: f64 = (0..D).map(|k| a[k] * b[k]).sum();
            for i in 0..D {
                let row = &mut matrix[(c * D + i) * n + d * D..][..D];
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry += lambda * a[i] * b[j] + mu * a[j] * b[i];
                }
                row[i] += mu * product;
            }
        }
    }
}
