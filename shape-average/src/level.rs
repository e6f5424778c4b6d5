//! The shapes on one level: phase fields and elastic weights of the level's interface width.

use crate::{AverageError, AverageParams};
use fe_grid::{Field, Grid};
use phasefield::{ElasticWeight, InterfaceLength, Profile};

/// The data of all shapes on one grid.
#[derive(Clone, Debug)]
pub struct LevelShapes<const D: usize> {
    grid: Grid<D>,
    interface_width: f64,
    /// Phase fields `v_i`.
    pub phase_fields: Vec<Field<f64, D, 1>>,
    /// Smooth indicators `chi_i`.
    pub indicators: Vec<Field<f64, D, 1>>,
}

impl<const D: usize> LevelShapes<D> {
    /// Phase fields and indicators of signed distances (positive inside) on their grid.
    ///
    /// # Errors
    /// Those of the profiles.
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
        })
    }

    /// Shapes whose phase fields and indicators come from elsewhere, on this grid.
    ///
    /// # Panics
    /// If there are not as many indicators as phase fields.
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
            phase_fields,
            indicators,
        }
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// The interface width `epsilon`.
    pub fn interface_width(&self) -> f64 {
        self.interface_width
    }

    /// Number of shapes.
    pub fn n_shapes(&self) -> usize {
        self.phase_fields.len()
    }

    /// The least mismatch that all shapes together can have: `pi/2 - 1` a unit of interface.
    pub(crate) fn mismatch_floor(&self) -> f64 {
        let length = InterfaceLength {
            interface_width: self.interface_width,
        };
        let lengths = self
            .phase_fields
            .iter()
            .map(|v| length.of(&self.grid, v.as_slice()));
        phasefield::profile::MISMATCH_FLOOR * lengths.sum::<f64>()
    }
}
