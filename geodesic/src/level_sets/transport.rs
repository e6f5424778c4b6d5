//! Motions of the shapes of a path that keep them matched.
//!
//! A velocity `v_k` of every inner shape changes the path by
//!
//! ```text
//! du_k = -Du_k . v_k,    dphi_k = v_k o phi_k,    dphi_{k+1} = -Dphi_{k+1} v_k :
//! ```
//!
//! the shape moves along, the deformation to it ends where it has moved and the one from it starts
//! there. To first order no match changes, which is what makes these directions the soft ones of
//! the energy. The map and its transpose are linear in nodal values.

use fe_grid::{Grid, locate};

/// The motions of one path.
pub(crate) struct Transport<const D: usize> {
    grid: Grid<D>,
    steps: usize,
    /// For every inner shape and component the derivative of its level set at the nodes.
    slopes: Vec<Vec<f64>>,
    /// For every step the gradient of its deformation at the nodes, `[i D + k]`.
    gradients: Vec<Vec<f64>>,
    /// For every step the cell that each node is mapped to, and the weights of its corners.
    targets: Vec<Vec<(usize, [f64; D])>>,
}

/// Where the parts of a path stand: `u_0, phi_1, u_1, ..., phi_K, u_K`.
pub(crate) fn level_set(n: usize, dimension: usize, k: usize) -> std::ops::Range<usize> {
    let first = k * (dimension + 1) * n;
    first..first + n
}

/// Where the displacement of `phi_k` stands, `k` from 1 on.
pub(crate) fn displacement(n: usize, dimension: usize, k: usize) -> std::ops::Range<usize> {
    let first = (k - 1) * (dimension + 1) * n + n;
    first..first + dimension * n
}

impl<const D: usize> Transport<D> {
    /// The motions at a path of `K` steps.
    pub fn new(grid: Grid<D>, x: &[f64], steps: usize) -> Self {
        let n = grid.n_nodes();
        let slopes = (1..steps)
            .map(|k| nodal_gradient(&grid, &x[level_set(n, D, k)]))
            .collect();
        let gradients = (1..=steps)
            .map(|k| {
                let u = &x[displacement(n, D, k)];
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
        let targets = (1..=steps)
            .map(|k| {
                let u = &x[displacement(n, D, k)];
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
            steps,
            slopes,
            gradients,
            targets,
        }
    }

    /// The corners of the cell that a node is mapped to, with their weights.
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
        for k in 1..self.steps {
            let v = &velocities[(k - 1) * D * n..k * D * n];
            let u = &mut out[level_set(n, D, k)];
            for i in 0..D {
                let slope = &self.slopes[k - 1][i * n..(i + 1) * n];
                for ((u, s), v) in u.iter_mut().zip(slope).zip(&v[i * n..]) {
                    *u -= s * v;
                }
            }
            let end = &mut out[displacement(n, D, k)];
            for (node, target) in self.targets[k - 1].iter().enumerate() {
                for (corner, weight) in &self.corners(target)[..1 << D] {
                    for i in 0..D {
                        end[i * n + node] += weight * v[i * n + corner];
                    }
                }
            }
            let begin = &mut out[displacement(n, D, k + 1)];
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

    /// The transpose: forces on the velocities from forces on the path.
    pub fn transpose(&self, forces: &[f64]) -> Vec<f64> {
        let n = self.grid.n_nodes();
        let mut out = vec![0.0; (self.steps - 1) * D * n];
        for k in 1..self.steps {
            let v = &mut out[(k - 1) * D * n..k * D * n];
            let u = &forces[level_set(n, D, k)];
            for i in 0..D {
                let slope = &self.slopes[k - 1][i * n..(i + 1) * n];
                for ((v, s), u) in v[i * n..].iter_mut().zip(slope).zip(u) {
                    *v -= s * u;
                }
            }
            let end = &forces[displacement(n, D, k)];
            for (node, target) in self.targets[k - 1].iter().enumerate() {
                for (corner, weight) in &self.corners(target)[..1 << D] {
                    for i in 0..D {
                        v[i * n + corner] += weight * end[i * n + node];
                    }
                }
            }
            let begin = &forces[displacement(n, D, k + 1)];
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

/// Differences at the nodes, central but at the faces of the box; one component after the other.
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
