//! The inverse of a deformation at the nodes, and the push-forward of fields.
//!
//! Every cell finds the nodes in the bounding box of its deformed corners, which holds its
//! image, and solves for each by Newton's method on the multilinear map of the cell. For a
//! deformation with positive determinant every node is found by at most one cell, up to shared
//! faces.

use crate::engine::element::MAX_CORNERS;
use crate::field::Field;
use crate::{Grid, ScalarField};
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

/// Newton's method is stopped at this residual, in units of the spacing.
const TOLERANCE: f64 = 1e-13;
/// A solution may stand this far outside its cell, in units of the cell: nodes on shared faces
/// must not be lost to rounding.
const OVERLAP: f64 = 1e-9;

/// The inverse of a deformation at the nodes of its grid.
#[derive(Clone, Debug)]
pub struct InverseDeformation<const D: usize> {
    grid: Grid<D>,
    /// For every node the point that is mapped to it, where there is one.
    position: Vec<Option<[f64; D]>>,
}

impl<const D: usize> InverseDeformation<D> {
    /// Inverts `Phi(x) = x + u(x)` at all nodes.
    pub fn new(displacement: &Field<f64, D, D>) -> Self {
        let grid = *displacement.grid();
        let layers = grid.cells_per_axis()[D - 1];
        let per_layer = grid.n_cells() / layers;
        let found: Vec<Vec<(usize, [f64; D])>> = (0..layers)
            .into_par_iter()
            .map(|layer| {
                let mut found = Vec::new();
                for cell in layer * per_layer..(layer + 1) * per_layer {
                    search_cell(&grid, displacement, grid.cell(cell), &mut found);
                }
                found
            })
            .collect();
        // The first cell in memory order wins, whatever the threads.
        let mut position = vec![None; grid.n_nodes()];
        for (node, x) in found.into_iter().flatten() {
            position[node].get_or_insert(x);
        }
        Self { grid, position }
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// The point that is mapped to a node; none where the node lies outside the image of the box.
    pub fn position(&self, node: usize) -> Option<[f64; D]> {
        self.position[node]
    }

    /// The field `f o Phi^{-1}` at the nodes, with `outside` where there is no inverse.
    pub fn push_forward(&self, field: &ScalarField<f64, D>, outside: f64) -> ScalarField<f64, D> {
        let mut pushed = ScalarField::zeros(self.grid);
        let values = pushed.as_mut_slice();
        for (value, position) in values.iter_mut().zip(&self.position) {
            *value = position.map_or(outside, |x| field.sample(x)[0]);
        }
        pushed
    }
}

/// Appends the nodes in the image of a cell with the points that are mapped to them.
fn search_cell<const D: usize>(
    grid: &Grid<D>,
    displacement: &Field<f64, D, D>,
    cell: [usize; D],
    found: &mut Vec<(usize, [f64; D])>,
) {
    let h = grid.spacing();
    let strides = grid.strides();
    let base = grid.node_index(cell);
    // Deformed corners in units of the spacing.
    let mut corners = [SVector::<f64, D>::zeros(); MAX_CORNERS];
    let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for c in 0..1usize << D {
        let index = base + (0..D).map(|k| (c >> k & 1) * strides[k]).sum::<usize>();
        let u = displacement.at(index);
        for k in 0..D {
            let y = (cell[k] + (c >> k & 1)) as f64 + u[k] / h;
            corners[c][k] = y;
            low[k] = low[k].min(y);
            high[k] = high[k].max(y);
        }
    }
    let nodes = grid.nodes_per_axis();
    let first: [usize; D] = std::array::from_fn(|k| (low[k] - OVERLAP).ceil().max(0.0) as usize);
    let count: [usize; D] = std::array::from_fn(|k| {
        let last = (high[k] + OVERLAP).floor().min((nodes[k] - 1) as f64);
        if last < first[k] as f64 {
            0
        } else {
            last as usize + 1 - first[k]
        }
    });
    let total: usize = count.iter().product();
    for mut code in 0..total {
        let node: [usize; D] = std::array::from_fn(|k| {
            let i = first[k] + code % count[k];
            code /= count[k];
            i
        });
        let target = SVector::from_fn(|k, _| node[k] as f64);
        if let Some(local) = invert_cell(&corners, &target) {
            let x = std::array::from_fn(|k| (cell[k] as f64 + local[k]) * h);
            found.push((grid.node_index(node), x));
        }
    }
}

/// Solves the multilinear map of a cell for a target; none where the solution is not in the cell.
fn invert_cell<const D: usize>(
    corners: &[SVector<f64, D>; MAX_CORNERS],
    target: &SVector<f64, D>,
) -> Option<SVector<f64, D>> {
    let mut local = SVector::<f64, D>::repeat(0.5);
    for _ in 0..40 {
        let (value, jacobian) = evaluate_cell(corners, &local);
        let residual = target - value;
        let small = residual.amax() <= TOLERANCE * (1.0 + target.amax());
        let step = solve(&jacobian, &residual)?;
        // Far outside the cell the map may fold: steps stay near it.
        let next = (local + step).map(|s| s.clamp(-0.5, 1.5));
        let moved = (next - local).amax();
        local = next;
        if small || moved <= 1e-15 {
            break;
        }
    }
    let (value, _) = evaluate_cell(corners, &local);
    let inside = local
        .iter()
        .all(|&s| (-OVERLAP..=1.0 + OVERLAP).contains(&s));
    let solved = (target - value).amax() <= 100.0 * TOLERANCE * (1.0 + target.amax());
    (inside && solved).then_some(local)
}

fn evaluate_cell<const D: usize>(
    corners: &[SVector<f64, D>; MAX_CORNERS],
    local: &SVector<f64, D>,
) -> (SVector<f64, D>, SMatrix<f64, D, D>) {
    let mut value = SVector::<f64, D>::zeros();
    let mut jacobian = SMatrix::<f64, D, D>::zeros();
    for c in 0..1usize << D {
        let side = |k: usize| {
            if c >> k & 1 == 1 {
                local[k]
            } else {
                1.0 - local[k]
            }
        };
        let weight: f64 = (0..D).map(side).product();
        value += corners[c] * weight;
        for k in 0..D {
            let others: f64 = (0..D).filter(|&j| j != k).map(side).product();
            let sign = if c >> k & 1 == 1 { 1.0 } else { -1.0 };
            let column = jacobian.column(k) + corners[c] * (sign * others);
            jacobian.set_column(k, &column);
        }
    }
    (value, jacobian)
}

/// Cramer's rule through the cofactor matrix.
fn solve<const D: usize>(
    jacobian: &SMatrix<f64, D, D>,
    rhs: &SVector<f64, D>,
) -> Option<SVector<f64, D>> {
    let a: [[f64; D]; D] = std::array::from_fn(|i| std::array::from_fn(|k| jacobian[(i, k)]));
    let cofactor = crate::tensor::cofactor(&a);
    let determinant = crate::tensor::determinant_with(&a, &cofactor);
    if determinant.abs() < 1e-300 {
        return None;
    }
    Some(SVector::from_fn(|k, _| {
        (0..D).map(|i| cofactor[i][k] * rhs[i]).sum::<f64>() / determinant
    }))
}
