//! The part of the metric for changes of the level sets with fixed deformations.
//!
//! With the change `s_k` of `u_k`, the mismatches have the Gauss–Newton form
//!
//! ```text
//! sum_k int m_k (s_k o phi_k - s_{k-1})^2,    s_0 = s_K = 0,    m_k = 2 eta H'(u_k)^2,
//! ```
//!
//! nearly the second difference in time at every node: a change common to all shapes costs least,
//! `K^2` times less than a change of a single shape. The inverse is approximated by
//!
//! ```text
//! m^-1/2 T^-1 m^-1/2,    T = tridiag(-1, 2, -1) in time.
//! ```
//!
//! Without `T`, the energy of paths of letters was a third higher after a hundred iterations.
//! Following the nodes along the deformations, where boundaries move by more than a cell per step,
//! gave no improvement: the gain is offset by the interpolation error.

use super::state::Layout;
use levelset::Arctan;

/// Lower bound of the weight of a level set's node, relative to that of a node on the boundary: far
/// from the boundary the mismatch hardly determines the level set.
const LEAST_NODE_WEIGHT: f64 = 5e-4;
/// Factor of this part of the metric: shapes that move by a cell per step are coupled less than `T`
/// assumes.
const SHARE: f64 = 2.0;

/// The changes of level sets along one path.
pub(crate) struct Residual<const D: usize> {
    layout: Layout<D>,
    /// For every inner shape the square roots of the inverse weights of its nodes.
    roots: Vec<Vec<f64>>,
}

impl<const D: usize> Residual<D> {
    /// Computes this part for a path; `weight` is that of a mismatch, times the volume of a cell.
    pub fn new(layout: Layout<D>, x: &[f64], step: Arctan, weight: f64) -> Self {
        let most = step.derivative(0.0f64).powi(2);
        let root = |u: &f64| {
            let slope = step.derivative(*u).powi(2).max(LEAST_NODE_WEIGHT * most);
            (SHARE / (2.0 * weight * slope)).sqrt()
        };
        Self {
            layout,
            roots: (1..layout.steps)
                .map(|k| x[layout.shape(k)].iter().map(root).collect())
                .collect(),
        }
    }

    /// Adds the image of forces on the level sets.
    pub fn apply_add(&self, forces: &[f64], out: &mut [f64]) {
        let weighted = |(k, roots): (usize, &Vec<f64>)| -> Vec<f64> {
            let own = &forces[self.layout.shape(k + 1)];
            own.iter().zip(roots).map(|(f, root)| f * root).collect()
        };
        let mut changes: Vec<_> = self.roots.iter().enumerate().map(weighted).collect();
        solve_in_time(&mut changes);
        for (k, (change, roots)) in changes.iter().zip(&self.roots).enumerate() {
            let own = &mut out[self.layout.shape(k + 1)];
            for (o, (s, root)) in own.iter_mut().zip(change.iter().zip(roots)) {
                *o += s * root;
            }
        }
    }
}

/// Solves `T s = f` with `T = tridiag(-1, 2, -1)` in time, for every node separately.
fn solve_in_time(f: &mut [Vec<f64>]) {
    // The pivots of the elimination are (k + 1) / k.
    for k in 1..f.len() {
        let factor = k as f64 / (k + 1) as f64;
        let (head, tail) = f.split_at_mut(k);
        for (own, before) in tail[0].iter_mut().zip(&head[k - 1]) {
            *own += factor * before;
        }
    }
    for k in (0..f.len()).rev() {
        let pivot = (k + 2) as f64 / (k + 1) as f64;
        let (head, tail) = f.split_at_mut(k + 1);
        let own = &mut head[k];
        if let Some(after) = tail.first() {
            for (own, after) in own.iter_mut().zip(after) {
                *own += after;
            }
        }
        for own in own.iter_mut() {
            *own /= pivot;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_elimination_inverts_second_differences() {
        let f: Vec<Vec<f64>> = (0..5).map(|k| vec![1.0 + f64::from(k), -0.3]).collect();
        let mut s = f.clone();
        solve_in_time(&mut s);
        for (k, f) in f.iter().enumerate() {
            for i in 0..2 {
                let before = if k > 0 { s[k - 1][i] } else { 0.0 };
                let after = if k < 4 { s[k + 1][i] } else { 0.0 };
                // Rounding of a handful of operations on numbers up to ten.
                assert!((2.0 * s[k][i] - before - after - f[i]).abs() < 1e-13);
            }
        }
    }
}
