//! The shapes on one level: phase fields and elastic weights of the level's interface width.

use crate::error::AverageError;
use crate::params::AverageParams;
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
    seen: Vec<Field<f64, D, 1>>,
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
            seen: Vec::new(),
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
            seen: Vec::new(),
        }
    }

    /// The same where not all of the shapes was seen: one weight a shape, 1 where it was and 0 where
    /// it was not. The mismatch of a shape counts with its weight.
    ///
    /// # Panics
    /// If there are weights, but not one a shape.
    #[must_use]
    pub fn with_seen(self, seen: Vec<Field<f64, D, 1>>) -> Self {
        assert!(seen.is_empty() || seen.len() == self.n_shapes());
        Self { seen, ..self }
    }

    /// The weights of what was seen, one a shape; none where everything was.
    pub fn seen(&self) -> &[Field<f64, D, 1>] {
        &self.seen
    }

    /// The coefficients of the mismatch of a shape.
    pub(crate) fn match_coefficients(&self, shape: usize) -> Vec<&[f64]> {
        let mut fields = vec![self.phase_fields[shape].as_slice()];
        fields.extend(self.seen.get(shape).map(Field::as_slice));
        fields
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
        let length = |(i, v): (usize, &Field<f64, D, 1>)| match self.seen.get(i) {
            Some(seen) => self.seen_length(v, seen),
            None => length.of(&self.grid, v.as_slice()),
        };
        let lengths = self.phase_fields.iter().enumerate().map(length);
        phasefield::profile::MISMATCH_FLOOR * lengths.sum::<f64>()
    }

    /// The length of the part of an interface that was seen. Both halves of the length are alike in
    /// an optimal profile, so that the one without derivatives tells it.
    fn seen_length(&self, v: &Field<f64, D, 1>, seen: &Field<f64, D, 1>) -> f64 {
        let nodes = v.as_slice().iter().zip(seen.as_slice());
        let sum: f64 = nodes.map(|(v, seen)| seen * (1.0 - v) * (1.0 - v)).sum();
        sum * self.grid.spacing().powi(D as i32) / (2.0 * self.interface_width)
    }
}
