//! Assembled matrices: twins of the applied operators.

use std::collections::BTreeMap;

use fe_grid::{Grid, LinearOperator};

/// The mass matrix `M_ab = ∫ N_a N_b` of multilinear elements.
pub fn mass_matrix<const D: usize>(grid: &Grid<D>) -> Matrix {
    weighted_mass_matrix(grid, |_, _| 1.0)
}

/// The stiffness matrix `L_ab = ∫ ∇N_a · ∇N_b` of multilinear elements.
pub fn stiffness_matrix<const D: usize>(grid: &Grid<D>) -> Matrix {
    weighted_stiffness_matrix(grid, |_, _| 1.0)
}

/// `M[ω]_ab = Σ_q w ω(x_q) N_a(x_q) N_b(x_q)` by the rule of two Gauss points an axis; `omega`
/// takes the place of the cell in memory and that of the point in the cell (bit `k` set: upper
/// point along axis `k`).
pub fn weighted_mass_matrix<const D: usize>(
    grid: &Grid<D>,
    omega: impl Fn(usize, usize) -> f64,
) -> Matrix {
    assemble(grid, omega, |point, a, b| {
        basis(point, a, None) * basis(point, b, None)
    })
}

/// `L[ω]_ab = Σ_q w ω(x_q) ∇N_a(x_q) · ∇N_b(x_q)`; see [`weighted_mass_matrix`].
pub fn weighted_stiffness_matrix<const D: usize>(
    grid: &Grid<D>,
    omega: impl Fn(usize, usize) -> f64,
) -> Matrix {
    let scale = grid.spacing().powi(-2);
    assemble(grid, omega, |point, a, b| {
        let product = |k| basis(point, a, Some(k)) * basis(point, b, Some(k));
        scale * (0..D).map(product).sum::<f64>()
    })
}

/// A sparse matrix: columns and values of each row.
#[derive(Clone, Debug)]
pub struct Matrix(Vec<Vec<(usize, f64)>>);

impl Matrix {
    /// `a` times this matrix and `b` times another one that couples the same nodes.
    pub fn combined(&self, a: f64, other: &Self, b: f64) -> Self {
        let entry = |(x, y): (&(usize, f64), &(usize, f64))| {
            assert_eq!(x.0, y.0);
            (x.0, a * x.1 + b * y.1)
        };
        let rows = self.0.iter().zip(&other.0);
        Self(
            rows.map(|(x, y)| x.iter().zip(y).map(entry).collect())
                .collect(),
        )
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        let entry = |(i, row): (usize, &Vec<(usize, f64)>)| {
            row.iter().find(|(column, _)| *column == i).unwrap().1
        };
        self.0.iter().enumerate().map(entry).collect()
    }

    /// The largest size of an entry.
    pub fn largest(&self) -> f64 {
        let entries = self.0.iter().flatten();
        entries.fold(0.0, |largest, (_, value)| value.abs().max(largest))
    }
}

impl LinearOperator for Matrix {
    fn dim(&self) -> usize {
        self.0.len()
    }
    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        assert_eq!((x.len(), y.len()), (self.dim(), self.dim()));
        for (out, row) in y.iter_mut().zip(&self.0) {
            *out = row.iter().map(|&(column, value)| value * x[column]).sum();
        }
    }
}

/// Sums `w ω(x_q) product(x_q, a, b)` over all points of all cells into the places of the nodes
/// at corners `a` and `b`.
fn assemble<const D: usize>(
    grid: &Grid<D>,
    omega: impl Fn(usize, usize) -> f64,
    product: impl Fn([f64; D], usize, usize) -> f64,
) -> Matrix {
    let corners = 1usize << D;
    let weight = grid.cell_volume() / corners as f64;
    let local: Vec<f64> = (0..corners * corners * corners)
        .map(|i| {
            let (q, a, b) = (i / (corners * corners), i / corners % corners, i % corners);
            weight * product(gauss_point(q), a, b)
        })
        .collect();
    let mut rows = vec![BTreeMap::new(); grid.n_nodes()];
    for cell in 0..grid.n_cells() {
        let nodes: Vec<usize> = corner_nodes(grid, cell);
        let weights: Vec<f64> = (0..corners).map(|q| omega(cell, q)).collect();
        for a in 0..corners {
            for b in 0..corners {
                let term = |q: usize| weights[q] * local[(q * corners + a) * corners + b];
                *rows[nodes[a]].entry(nodes[b]).or_insert(0.0) +=
                    (0..corners).map(term).sum::<f64>();
            }
        }
    }
    Matrix(
        rows.into_iter()
            .map(|row| row.into_iter().collect())
            .collect(),
    )
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
