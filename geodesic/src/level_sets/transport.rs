//! Motions of the shapes of a path that preserve their mismatches.
//!
//! A velocity `v_k` of every inner shape changes the path by
//!
//! ```text
//! du_k = -Du_k . v_k,    dphi_k = v_k o phi_k,    dphi_{k+1} = -Dphi_{k+1} v_k :
//! ```
//!
//! the shape moves along, the deformation to it ends at the moved shape and the deformation from it
//! starts there. To first order no mismatch changes, so these are the soft directions of the
//! energy. The map and its transpose are linear in the nodal values.

use super::state::Layout;
use fe_grid::{Grid, locate};

/// The motions of one path.
pub(crate) struct Transport<const D: usize> {
    grid: Grid<D>,
    layout: Layout<D>,
    /// For every inner shape and level set of it the derivatives at the nodes.
    slopes: Vec<Vec<Vec<f64>>>,
    /// For every step the gradient of its deformation at the nodes, `[i D + k]`.
    gradients: Vec<Vec<f64>>,
    /// For every step the cell that each node is mapped to, and the weights of its corners.
    targets: Vec<Vec<(usize, [f64; D])>>,
}

impl<const D: usize> Transport<D> {
    /// Computes the motions at a path of `K` steps.
    pub fn new(grid: Grid<D>, layout: Layout<D>, x: &[f64]) -> Self {
        let n = grid.n_nodes();
        let slopes = (1..layout.steps)
            .map(|k| {
                (0..layout.components)
                    .map(|i| nodal_gradient(&grid, &x[layout.level_set(k, i)]))
                    .collect()
            })
            .collect();
        let gradients = (1..=layout.steps)
            .map(|k| {
                let u = &x[layout.displacement(k)];
                let mut all = Vec::with_capacity(D * D * n);
                for (i, component) in u.chunks_exact(n).enumerate() {
                    let mut slope = nodal_gradient(&grid, component);
                    for value in &mut slope[i * n..(i + 1) * n] {
                        *value += 1.0;
                    }
                    all.append(&mut slope);
                }
                all
            })
            .collect();
        let targets = (1..=layout.steps)
            .map(|k| {
                let u = &x[layout.displacement(k)];
                (0..n)
                    .map(|node| {
                        let mut position = grid.position(grid.node(node));
                        for i in 0..D {
                            position[i] += u[i * n + node];
                        }
                        let (cell, local) = locate(&grid, position);
                        (grid.node_index(cell), local)
                    })
                    .collect()
            })
            .collect();
        Self {
            grid,
            layout,
            slopes,
            gradients,
            targets,
        }
    }

    /// Returns the corners of the cell that a node is mapped to, with their weights.
    fn corners(&self, (first, local): &(usize, [f64; D])) -> [(usize, f64); 8] {
        let strides = self.grid.strides();
        let mut corners = [(0, 0.0); 8];
        for (c, corner) in corners.iter_mut().enumerate().take(1 << D) {
            let (mut weight, mut node) = (1.0, *first);
            for k in 0..D {
                if c >> k & 1 == 1 {
                    weight *= local[k];
                    node += strides[k];
                } else {
                    weight *= 1.0 - local[k];
                }
            }
            *corner = (node, weight);
        }
        corners
    }

    /// Adds the change of the path under velocities `v_1, ..., v_{K-1}` to `out`.
    pub fn apply_add(&self, velocities: &[f64], out: &mut [f64]) {
        let n = self.grid.n_nodes();
        for k in 1..self.layout.steps {
            let v = &velocities[(k - 1) * D * n..k * D * n];
            for (component, slopes) in self.slopes[k - 1].iter().enumerate() {
                let u = &mut out[self.layout.level_set(k, component)];
                for i in 0..D {
                    let slope = &slopes[i * n..(i + 1) * n];
                    for ((u, s), v) in u.iter_mut().zip(slope).zip(&v[i * n..]) {
                        *u -= s * v;
                    }
                }
            }
            let end = &mut out[self.layout.displacement(k)];
            for (node, target) in self.targets[k - 1].iter().enumerate() {
                for (corner, weight) in &self.corners(target)[..1 << D] {
                    for i in 0..D {
                        end[i * n + node] += weight * v[i * n + corner];
                    }
                }
            }
            let begin = &mut out[self.layout.displacement(k + 1)];
            let gradient = &self.gradients[k];
            for i in 0..D {
                for j in 0..D {
                    let a = &gradient[(i * D + j) * n..(i * D + j + 1) * n];
                    let target = begin[i * n..(i + 1) * n].iter_mut();
                    for ((b, a), v) in target.zip(a).zip(&v[j * n..]) {
                        *b -= a * v;
                    }
                }
            }
        }
    }

    /// Applies the transpose: forces on the velocities from forces on the path.
    pub fn transpose(&self, forces: &[f64]) -> Vec<f64> {
        let n = self.grid.n_nodes();
        let mut out = vec![0.0; (self.layout.steps - 1) * D * n];
        for k in 1..self.layout.steps {
            let v = &mut out[(k - 1) * D * n..k * D * n];
            for (component, slopes) in self.slopes[k - 1].iter().enumerate() {
                let u = &forces[self.layout.level_set(k, component)];
                for i in 0..D {
                    let slope = &slopes[i * n..(i + 1) * n];
                    for ((v, s), u) in v[i * n..].iter_mut().zip(slope).zip(u) {
                        *v -= s * u;
                    }
                }
            }
            let end = &forces[self.layout.displacement(k)];
            for (node, target) in self.targets[k - 1].iter().enumerate() {
                for (corner, weight) in &self.corners(target)[..1 << D] {
                    for i in 0..D {
                        v[i * n + corner] += weight * end[i * n + node];
                    }
                }
            }
            let begin = &forces[self.layout.displacement(k + 1)];
            let gradient = &self.gradients[k];
            for i in 0..D {
                for j in 0..D {
                    let a = &gradient[(i * D + j) * n..(i * D + j + 1) * n];
                    let source = begin[i * n..(i + 1) * n].iter();
                    for ((v, a), b) in v[j * n..].iter_mut().zip(a).zip(source) {
                        *v -= a * b;
                    }
                }
            }
        }
        out
    }
}

/// Computes differences at the nodes, central except at the faces of the box; one component after
/// the other.
fn nodal_gradient<const D: usize>(grid: &Grid<D>, values: &[f64]) -> Vec<f64> {
    let n = grid.n_nodes();
    let (nodes, strides) = (grid.nodes_per_axis(), grid.strides());
    let mut out = vec![0.0; D * n];
    for index in 0..n {
        let node = grid.node(index);
        for k in 0..D {
            let low = if node[k] > 0 {
                index - strides[k]
            } else {
                index
            };
            let high = if node[k] + 1 < nodes[k] {
                index + strides[k]
            } else {
                index
            };
            let cells = ((high - low) / strides[k]) as f64;
            out[k * n + index] = (values[high] - values[low]) / (cells * grid.spacing());
        }
    }
    out
}
