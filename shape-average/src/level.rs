//! The shapes on one level: phase fields and elastic weights for the level's interface width.

use crate::error::AverageError;
use crate::params::AverageParams;
use fe_grid::{Distribution, Field, Grid};
use phasefield::{ElasticWeight, Profile};

/// The data of all shapes on one grid; where they are distributed to processes, of those of this process.
#[derive(Clone, Debug)]
pub struct LevelShapes<const D: usize> {
    grid: Grid<D>,
    interface_width: f64,
    /// Phase fields `v_i`.
    pub phase_fields: Vec<Field<f64, D, 1>>,
    /// Smooth indicators `chi_i`.
    pub indicators: Vec<Field<f64, D, 1>>,
    seen: Vec<Field<f64, D, 1>>,
    distribution: Distribution,
}

impl<const D: usize> LevelShapes<D> {
    /// Computes phase fields and indicators from signed distances (positive inside) on their grid.
    ///
    /// # Errors
    /// Those of the phase-field profiles.
    pub fn new(
        grid: Grid<D>,
        signed_distances: &[Field<f64, D, 1>],
        params: &AverageParams,
    ) -> Result<Self, AverageError> {
        let interface_width = params.interface_cells * grid.spacing();
        let profile = Profile::new(interface_width)?;
        let weight = ElasticWeight::new(interface_width, params.void_stiffness)?;
        Ok(Self {
            grid,
            interface_width,
            phase_fields: signed_distances
                .iter()
                .map(|u| profile.phase_field(u))
                .collect(),
            indicators: signed_distances
                .iter()
                .map(|u| weight.indicator_field(u))
                .collect(),
            seen: Vec::new(),
            distribution: Distribution::alone(signed_distances.len()),
        })
    }

    /// Creates shapes from given phase fields and indicators on this grid.
    ///
    /// # Panics
    /// If the numbers of indicators and phase fields differ.
    pub fn from_fields(
        grid: Grid<D>,
        interface_width: f64,
        phase_fields: Vec<Field<f64, D, 1>>,
        indicators: Vec<Field<f64, D, 1>>,
    ) -> Self {
        assert_eq!(phase_fields.len(), indicators.len());
        Self {
            grid,
            interface_width,
            distribution: Distribution::alone(phase_fields.len()),
            phase_fields,
            indicators,
            seen: Vec::new(),
        }
    }

    /// Declares these shapes to be those that this process has of all.
    ///
    /// # Panics
    /// If it does not have so many.
    #[must_use]
    pub fn distributed(self, distribution: Distribution) -> Self {
        assert_eq!(distribution.own().len(), self.n_own());
        Self {
            distribution,
            ..self
        }
    }

    /// Sets the visibility masks: one field per shape, 1 where it is visible and 0 where it is
    /// hidden. The mismatch of a shape is multiplied by its mask.
    ///
    /// # Panics
    /// If there are masks, but not one per shape.
    #[must_use]
    pub fn with_visibility(self, seen: Vec<Field<f64, D, 1>>) -> Self {
        assert!(seen.is_empty() || seen.len() == self.n_own());
        Self { seen, ..self }
    }

    /// Returns the visibility masks, one per shape; empty if all shapes are fully visible.
    pub fn seen(&self) -> &[Field<f64, D, 1>] {
        &self.seen
    }

    /// Returns the coefficients of the mismatch of a shape.
    pub(crate) fn match_coefficients(&self, shape: usize) -> Vec<&[f64]> {
        let mut fields = vec![self.phase_fields[shape].as_slice()];
        fields.extend(self.seen.get(shape).map(Field::as_slice));
        fields
    }

    /// Returns the grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Returns the interface width `epsilon`.
    pub fn interface_width(&self) -> f64 {
        self.interface_width
    }

    /// Returns the number of shapes of all processes.
    pub fn n_shapes(&self) -> usize {
        self.distribution.n_parts()
    }

    /// Returns the number of shapes of this process.
    pub fn n_own(&self) -> usize {
        self.phase_fields.len()
    }

    /// Returns the distribution of the shapes to processes.
    pub fn distribution(&self) -> &Distribution {
        &self.distribution
    }
}

/// Returns the displacement of one shape.
pub(crate) fn shape(x: &[f64], i: usize, dim: usize) -> &[f64] {
    &x[i * dim..(i + 1) * dim]
}
