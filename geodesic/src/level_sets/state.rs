//! A path of level sets as a minimiser and a caller see it.

use super::transport::{displacement, level_set};
use crate::GeodesicError;
use fe_grid::transfer::prolong_into;
use fe_grid::{Field, Grid};

/// A path of level sets and the deformations between them.
#[derive(Clone, Debug)]
pub struct PathState<const D: usize> {
    /// Level sets `u_0, ..., u_K`.
    pub level_sets: Vec<Field<f64, D, 1>>,
    /// Displacements of `phi_1, ..., phi_K`.
    pub displacements: Vec<Field<f64, D, D>>,
}

impl<const D: usize> PathState<D> {
    /// The state as one vector.
    pub(super) fn to_vector(&self) -> Vec<f64> {
        let mut x = self.level_sets[0].as_slice().to_vec();
        for (u, phi) in self.level_sets[1..].iter().zip(&self.displacements) {
            x.extend_from_slice(phi.as_slice());
            x.extend_from_slice(u.as_slice());
        }
        x
    }

    pub(super) fn from_vector(
        grid: Grid<D>,
        x: &[f64],
        steps: usize,
    ) -> Result<Self, GeodesicError> {
        let n = grid.n_nodes();
        let level_sets: Result<Vec<_>, _> = (0..=steps)
            .map(|k| Field::from_vec(grid, x[level_set(n, D, k)].to_vec()))
            .collect();
        let displacements: Result<Vec<_>, _> = (1..=steps)
            .map(|k| Field::from_vec(grid, x[displacement(n, D, k)].to_vec()))
            .collect();
        Ok(Self {
            level_sets: level_sets?,
            displacements: displacements?,
        })
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.displacements.len()
    }

    /// Every second shape, and the deformations between these.
    pub(super) fn halved(&self) -> Self {
        let grid = *self.level_sets[0].grid();
        Self {
            level_sets: self.level_sets.iter().step_by(2).cloned().collect(),
            displacements: self
                .displacements
                .chunks(2)
                .map(|pair| compose(&grid, pair))
                .collect(),
        }
    }

    /// The same path on the grid of half the spacing.
    pub(super) fn finer(&self) -> Self {
        let coarse_grid = *self.level_sets[0].grid();
        let grid = coarse_grid.finer();
        let mut fine = Self {
            level_sets: vec![Field::zeros(grid); self.level_sets.len()],
            displacements: vec![Field::zeros(grid); self.displacements.len()],
        };
        for (fine, coarse) in fine.level_sets.iter_mut().zip(&self.level_sets) {
            prolong_into(&coarse_grid, coarse.as_slice(), fine.as_mut_slice());
        }
        for (fine, coarse) in fine.displacements.iter_mut().zip(&self.displacements) {
            prolong_into(&coarse_grid, coarse.as_slice(), fine.as_mut_slice());
        }
        fine
    }
}

/// The displacement of motions one after the other.
pub(super) fn compose<const D: usize>(
    grid: &Grid<D>,
    motions: &[Field<f64, D, D>],
) -> Field<f64, D, D> {
    let n = grid.n_nodes();
    let mut total = Field::zeros(*grid);
    for motion in motions {
        for index in 0..n {
            let mut position = grid.position(grid.node(index));
            let moved = total.at(index);
            for k in 0..D {
                position[k] += moved[k];
            }
            let step = motion.sample(position);
            for k in 0..D {
                total.component_mut(k)[index] += step[k];
            }
        }
    }
    total
}
