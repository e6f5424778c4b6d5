//! The shapes on one level: phase fields and elastic weights for the level's interface width.

use crate::collect::collected;
use crate::error::AverageError;
use crate::params::AverageParams;
use crate::shapes::Shapes;
use fe_grid::{Distribution, Field, Grid, parallel};
use phasefield::{ElasticWeight, Profile};

/// The data of all shapes on one grid; where they are distributed to processes, of those of this process.
#[derive(Clone, Debug)]
pub struct LevelShapes<const D: usize> {
    grid: Grid<D>,
    interface_width: f64,
    /// Phase fields `v_i` of the shapes; of several components those of the first shape before those of the
    /// second.
    pub phase_fields: Vec<Field<f64, D, 1>>,
    /// Smooth indicators `chi_i` of the whole shapes.
    pub indicators: Vec<Field<f64, D, 1>>,
    seen: Vec<Field<f64, D, 1>>,
    n_components: usize,
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
        Self::of_shapes(grid, Shapes::new(signed_distances), params)
    }

    /// Computes the phase fields of all components, and the indicators of the whole shapes, from their
    /// signed distances on their grid.
    ///
    /// # Errors
    /// Those of the phase-field profiles.
    pub fn of_shapes(
        grid: Grid<D>,
        shapes: Shapes<'_, D>,
        params: &AverageParams,
    ) -> Result<Self, AverageError> {
        let interface_width = params.interface_cells * grid.spacing();
        let profile = Profile::new(interface_width)?;
        let weight = ElasticWeight::new(interface_width, params.void_stiffness)?;
        Ok(Self {
            grid,
            interface_width,
            phase_fields: parallel::map(
                (0..shapes.len()).flat_map(|i| shapes.components_of(i)),
                &|u| profile.phase_field(u),
            ),
            indicators: parallel::map(shapes.whole(), &|u| weight.indicator_field(u)),
            seen: Vec::new(),
            n_components: shapes.n_components(),
            distribution: Distribution::alone(shapes.len()),
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
        Self::from_components(grid, interface_width, 1, phase_fields, indicators)
    }

    /// Creates shapes of this number of components from given phase fields, all of the first shape before
    /// those of the second, and indicators of the whole shapes, on this grid.
    ///
    /// # Panics
    /// If the number of phase fields is not that of the indicators times that of the components.
    pub fn from_components(
        grid: Grid<D>,
        interface_width: f64,
        n_components: usize,
        phase_fields: Vec<Field<f64, D, 1>>,
        indicators: Vec<Field<f64, D, 1>>,
    ) -> Self {
        assert_eq!(phase_fields.len(), n_components * indicators.len());
        Self {
            grid,
            interface_width,
            distribution: Distribution::alone(indicators.len()),
            phase_fields,
            indicators,
            seen: Vec::new(),
            n_components,
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

    /// Returns the coefficients of the mismatch of a component of a shape.
    pub(crate) fn match_coefficients(&self, shape: usize, component: usize) -> Vec<&[f64]> {
        let place = shape * self.n_components + component;
        let mut fields = vec![self.phase_fields[place].as_slice()];
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
        self.indicators.len()
    }

    /// Returns the number of components of a shape.
    pub fn n_components(&self) -> usize {
        self.n_components
    }

    /// The shapes of all processes on the first one; the others keep their own. Collective.
    ///
    /// # Errors
    /// Those of fields.
    pub(crate) fn collected(self) -> Result<Self, AverageError> {
        let all = |own| collected(own, &self.grid, &self.distribution);
        let (phase_fields, indicators) = (all(self.phase_fields)?, all(self.indicators)?);
        let seen = all(self.seen)?;
        let (width, components) = (self.interface_width, self.n_components);
        let all = Self::from_components(self.grid, width, components, phase_fields, indicators);
        Ok(all.with_visibility(seen))
    }

    /// Returns the distribution of the shapes to processes.
    pub fn distribution(&self) -> &Distribution {
        &self.distribution
    }
}

/// Returns the displacement of one shape.
pub(crate) fn shape<T>(x: &[T], i: usize, dim: usize) -> &[T] {
    &x[i * dim..(i + 1) * dim]
}
