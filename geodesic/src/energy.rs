//! The energy of a path and its terms, for both forms.

use crate::cells;
use serde::Serialize;

/// The terms of the energy of a path, without weights.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PathEnergy {
    /// Energies `W_k` of the steps.
    pub step_energies: Vec<f64>,
    /// Mismatches, summed over the components: between the last shape and the end shape, or between
    /// every shape and the next for paths of level sets.
    pub mismatches: Vec<f64>,
    /// Boundary areas of the shapes `1, ..., K`, summed over the components; paths of level sets
    /// only.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub areas: Vec<f64>,
    /// The barrier that prevents the corners of cells from folding, summed over the deformations;
    /// zero if no determinant is below its onset.
    pub barrier: f64,
    /// Objective: `K sum W_k + eta sum mismatch_k + mu/K sum area_k`, and the barrier.
    pub total: f64,
}

impl PathEnergy {
    /// Returns the length `sum sqrt W_k` of the path.
    pub fn length(&self) -> f64 {
        cells::length(&self.step_energies)
    }

    /// Returns the dissipation `K sum W_k`, never less than the square of the length.
    pub fn dissipation(&self) -> f64 {
        cells::dissipation(&self.step_energies)
    }
}
