//! A path of level sets, as a vector of unknowns and as fields.

use crate::error::GeodesicError;
use crate::extension::inverse_displacement;
use crate::shape::union_of;
use fe_grid::transfer::prolong_into;
use fe_grid::{Field, Grid, ScalarField};
use std::ops::Range;

/// Positions of the parts of a path in the vector of unknowns: the level sets of `u_0`, then
/// `phi_1`, the level sets of `u_1`, and so on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout<const D: usize> {
    /// Number of nodes of the grid.
    pub nodes: usize,
    /// Number of level sets of every shape.
    pub components: usize,
    /// Number of steps of the path.
    pub steps: usize,
}

impl<const D: usize> Layout<D> {
    /// Returns the length of the vector.
    pub fn len(&self) -> usize {
        self.steps * self.stride() + self.components * self.nodes
    }

    /// Returns the length of a deformation together with the level sets of its target shape.
    pub fn stride(&self) -> usize {
        (D + self.components) * self.nodes
    }

    /// Returns the range of the level set of a component of shape `k`, both counted from 0.
    pub fn level_set(&self, k: usize, component: usize) -> Range<usize> {
        let first = k * self.stride() + component * self.nodes;
        first..first + self.nodes
    }

    /// Returns the range of all level sets of shape `k`.
    pub fn shape(&self, k: usize) -> Range<usize> {
        let first = k * self.stride();
        first..first + self.components * self.nodes
    }

    /// Returns the range of the displacement of `phi_k`, `k` counted from 1.
    pub fn displacement(&self, k: usize) -> Range<usize> {
        let first = (k - 1) * self.stride() + self.components * self.nodes;
        first..first + D * self.nodes
    }

    /// Computes the level set of the union of the components of shape `k`, at the nodes.
    pub fn union(&self, x: &[f64], k: usize) -> Vec<f64> {
        let mut union = x[self.level_set(k, 0)].to_vec();
        for component in 1..self.components {
            for (u, v) in union.iter_mut().zip(&x[self.level_set(k, component)]) {
                *u = u.max(*v);
            }
        }
        union
    }
}

/// A path of level sets and the deformations between them.
#[derive(Clone, Debug)]
pub struct PathState<const D: usize> {
    /// The shapes `0, ..., K`: the level sets of their components.
    pub shapes: Vec<Vec<ScalarField<f64, D>>>,
    /// Displacements of `phi_1, ..., phi_K`.
    pub displacements: Vec<Field<f64, D, D>>,
}

impl<const D: usize> PathState<D> {
    /// Returns the grid of all fields.
    pub fn grid(&self) -> &Grid<D> {
        self.shapes[0][0].grid()
    }

    /// Returns the number of steps.
    pub fn steps(&self) -> usize {
        self.displacements.len()
    }

    /// Computes the level set of the union of the components of shape `k`.
    pub fn union(&self, k: usize) -> ScalarField<f64, D> {
        union_of(&self.shapes[k])
    }

    pub(crate) fn layout(&self) -> Layout<D> {
        Layout {
            nodes: self.grid().n_nodes(),
            components: self.shapes[0].len(),
            steps: self.steps(),
        }
    }

    /// Returns the state as one vector.
    pub(super) fn to_vector(&self) -> Vec<f64> {
        let layout = self.layout();
        let mut x = vec![0.0; layout.len()];
        for (k, shape) in self.shapes.iter().enumerate() {
            for (component, u) in shape.iter().enumerate() {
                x[layout.level_set(k, component)].copy_from_slice(u.as_slice());
            }
        }
        for (k, phi) in self.displacements.iter().enumerate() {
            x[layout.displacement(k + 1)].copy_from_slice(phi.as_slice());
        }
        x
    }

    pub(super) fn from_vector(
        grid: Grid<D>,
        layout: &Layout<D>,
        x: &[f64],
    ) -> Result<Self, GeodesicError> {
        let shape = |k: usize| -> Result<Vec<_>, GeodesicError> {
            let levels = (0..layout.components).map(|i| x[layout.level_set(k, i)].to_vec());
            Ok(levels
                .map(|u| Field::from_vec(grid, u))
                .collect::<Result<_, _>>()?)
        };
        let displacements: Result<Vec<_>, _> = (1..=layout.steps)
            .map(|k| Field::from_vec(grid, x[layout.displacement(k)].to_vec()))
            .collect();
        Ok(Self {
            shapes: (0..=layout.steps).map(shape).collect::<Result<_, _>>()?,
            displacements: displacements?,
        })
    }

    /// Returns the path of every second shape, with the deformations between these.
    pub(super) fn halved(&self) -> Self {
        let grid = *self.grid();
        Self {
            shapes: self.shapes.iter().step_by(2).cloned().collect(),
            displacements: self
                .displacements
                .chunks(2)
                .map(|pair| compose(&grid, pair))
                .collect(),
        }
    }

    /// Returns the path from its end to its start.
    pub(super) fn reversed(mut self) -> Self {
        self.shapes.reverse();
        self.displacements.reverse();
        for displacement in &mut self.displacements {
            *displacement = inverse_displacement(displacement);
        }
        self
    }

    /// Prolongs the path to the grid of half the spacing.
    pub(super) fn finer(&self) -> Self {
        let coarse_grid = *self.grid();
        let grid = coarse_grid.finer();
        let finer = |coarse: &ScalarField<f64, D>| {
            let mut fine = Field::zeros(grid);
            prolong_into(&coarse_grid, coarse.as_slice(), fine.as_mut_slice());
            fine
        };
        let displacements = self.displacements.iter().map(|coarse| {
            let mut fine = Field::zeros(grid);
            prolong_into(&coarse_grid, coarse.as_slice(), fine.as_mut_slice());
            fine
        });
        Self {
            displacements: displacements.collect(),
            shapes: self
                .shapes
                .iter()
                .map(|shape| shape.iter().map(finer).collect())
                .collect(),
        }
    }
}

/// Computes the displacement of the composition of motions.
pub(crate) fn compose<const D: usize>(
    grid: &Grid<D>,
    motions: &[Field<f64, D, D>],
) -> Field<f64, D, D> {
    let mut total = Field::zeros(*grid);
    for motion in motions {
        let step = motion.compose(total.as_slice());
        for (total, step) in total.as_mut_slice().iter_mut().zip(step.as_slice()) {
            *total += step;
        }
    }
    total
}
