//! Rigid motions of deformations: the null space of the energy of a step.
//!
//! `W(a, b)` does not change if `a` and `b` are composed with any two rigid motions, so a geodesic
//! of two steps determines its unknown deformation up to one. It is chosen in the least squares
//! sense over the matter of the object:
//!
//! - a midpoint is moved as near as possible to the mean of its neighbours;
//! - an extension repeats the rigid motion of the preceding step: `rig(b, c) = rig(a, b)`, where
//!   `rig(a, b)` is the rigid motion that brings `a` nearest to `b`. A rigid rotation and
//!   translation is thus continued; no frame is preferred, and the choice is symmetric in time.

use fe_grid::Grid;
use levelset::RigidMotion;
use nalgebra::{SMatrix, SVector};

/// Mass distribution at the nodes of a grid.
pub(super) struct Matter<const D: usize> {
    grid: Grid<D>,
    /// Fraction of the mass at every node.
    shares: Vec<f64>,
}

impl<const D: usize> Matter<D> {
    /// Creates the distribution from a density at the nodes, which is positive somewhere.
    pub fn new(grid: Grid<D>, density: Vec<f64>) -> Self {
        let mass: f64 = density.iter().sum();
        let shares = density.into_iter().map(|m| m / mass).collect();
        Self { grid, shares }
    }

    /// Returns the root mean square of a displacement.
    pub fn norm(&self, displacement: &[f64]) -> f64 {
        let n = self.shares.len();
        let squares = displacement.chunks_exact(n).map(|component| {
            let pairs = component.iter().zip(&self.shares);
            pairs.map(|(u, share)| share * u * u).sum::<f64>()
        });
        squares.sum::<f64>().sqrt()
    }

    fn place(&self, displacement: &[f64], node: usize) -> SVector<f64, D> {
        let n = self.shares.len();
        let x = self.grid.position(self.grid.node(node));
        SVector::from_fn(|k, _| x[k] + displacement[k * n + node])
    }

    fn centre(&self, displacement: &[f64]) -> SVector<f64, D> {
        self.sum(|node| self.place(displacement, node))
    }

    fn sum<const C: usize>(
        &self,
        term: impl Fn(usize) -> SMatrix<f64, D, C>,
    ) -> SMatrix<f64, D, C> {
        let mut sum = SMatrix::zeros();
        for (node, &share) in self.shares.iter().enumerate() {
            if share > 0.0 {
                sum += term(node) * share;
            }
        }
        sum
    }

    /// Computes the rigid motion that brings one deformation, given by its displacement, nearest to
    /// another.
    pub fn fit(&self, from: &[f64], to: &[f64]) -> RigidMotion<D> {
        let shares = self.shares.iter().copied().enumerate();
        let shares = shares.filter(|(_, share)| *share > 0.0);
        let place = |(node, share)| (share, self.place(from, node), self.place(to, node));
        RigidMotion::nearest(shares.map(place))
    }

    /// Applies a rigid motion to a deformation.
    pub fn apply(&self, motion: &RigidMotion<D>, displacement: &mut [f64]) {
        let n = self.shares.len();
        for node in 0..n {
            let x = self.grid.position(self.grid.node(node));
            let y = motion.map(self.place(displacement, node).into());
            for k in 0..D {
                displacement[k * n + node] = y[k] - x[k];
            }
        }
    }

    /// Returns infinitesimal rigid motions of a deformation, orthonormal over the matter.
    pub fn modes(&self, displacement: &[f64]) -> Vec<Vec<f64>> {
        let n = self.shares.len();
        let centre = self.centre(displacement);
        let mut modes: Vec<Vec<f64>> = Vec::new();
        let mut add = |mut mode: Vec<f64>| {
            for other in &modes {
                self.remove(other, &mut mode);
            }
            let size = self.norm(&mode);
            if size > 0.0 {
                for x in &mut mode {
                    *x /= size;
                }
                modes.push(mode);
            }
        };
        for k in 0..D {
            let mut mode = vec![0.0; D * n];
            mode[k * n..(k + 1) * n].fill(1.0);
            add(mode);
        }
        for i in 0..D {
            for k in 0..i {
                let mut mode = vec![0.0; D * n];
                for node in 0..n {
                    let y = self.place(displacement, node) - centre;
                    mode[i * n + node] = y[k];
                    mode[k * n + node] = -y[i];
                }
                add(mode);
            }
        }
        modes
    }

    /// Removes from a displacement its component along a mode.
    pub fn remove(&self, mode: &[f64], displacement: &mut [f64]) {
        let n = self.shares.len();
        let mut share = 0.0;
        for (u, m) in displacement.chunks_exact(n).zip(mode.chunks_exact(n)) {
            for ((u, m), mass) in u.iter().zip(m).zip(&self.shares) {
                share += mass * u * m;
            }
        }
        for (u, m) in displacement.iter_mut().zip(mode) {
            *u -= share * m;
        }
    }
}
