//! The arrays of a result directory, in double precision.

use std::path::Path;

use fe_grid::{Field, ScalarField};

use super::npy::{Precision, write_field, write_mask};
use super::{OutputError, ResultDir, deformation, numbered};

impl ResultDir {
    /// Writes a field.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`], as for all arrays.
    pub(crate) fn array<const D: usize, const M: usize>(
        &self,
        name: impl AsRef<Path>,
        field: &Field<f64, D, M>,
    ) -> Result<(), OutputError> {
        write_field(&self.file(name), field, Precision::Double)
    }

    /// Writes fields as `kind_000.npy` and so on, numbered from `first`.
    pub(crate) fn arrays<'a, const D: usize, const M: usize>(
        &self,
        kind: &str,
        first: usize,
        fields: impl IntoIterator<Item = &'a Field<f64, D, M>>,
    ) -> Result<(), OutputError> {
        let mut fields = fields.into_iter().enumerate();
        fields.try_for_each(|(i, field)| self.array(numbered(kind, first + i, "npy"), field))
    }

    /// Writes the deformed positions of displacements as [`Self::arrays`].
    pub(crate) fn deformations<const D: usize>(
        &self,
        kind: &str,
        first: usize,
        displacements: &[Field<f64, D, D>],
    ) -> Result<(), OutputError> {
        let mut displacements = displacements.iter().enumerate();
        displacements.try_for_each(|(i, displacement)| {
            self.array(numbered(kind, first + i, "npy"), &deformation(displacement))
        })
    }

    /// Writes where a field is above a level, as a mask.
    pub(crate) fn object<const D: usize>(
        &self,
        name: impl AsRef<Path>,
        field: &ScalarField<f64, D>,
        level: f64,
    ) -> Result<(), OutputError> {
        let mask: Vec<bool> = field
            .as_slice()
            .iter()
            .map(|&value| value > level)
            .collect();
        write_mask(&self.file(name), &mask, &field.grid().nodes_per_axis())
    }
}
