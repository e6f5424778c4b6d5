//! The arrays and the record of a result, in a directory or in memory.

use std::path::Path;

use fe_grid::{Field, ScalarField};
use serde::Serialize;

use super::json::json;
use super::kept::KeptNumbers;
use super::matrix::write_matrix_array;
use super::npy::{Precision, write_field, write_mask};
use super::{OutputError, ResultDir, deformation, numbered, write_json};

impl ResultDir {
    /// Writes a field in double precision.
    ///
    /// # Errors
    /// [`OutputError::Unwritable`], as for all arrays.
    pub(crate) fn array<const D: usize, const M: usize>(
        &self,
        name: impl AsRef<Path>,
        field: &Field<f64, D, M>,
    ) -> Result<(), OutputError> {
        match self.kept() {
            Some(mut kept) => {
                kept.field(name.as_ref(), field);
                Ok(())
            }
            None => write_field(&self.file(name), field, Precision::Double),
        }
    }

    /// Writes fields as `kind_000.npy` and so on, numbered from `first`.
    pub(crate) fn arrays<'a, const D: usize, const M: usize>(
        &self,
        kind: &str,
        first: usize,
        fields: impl IntoIterator<Item = &'a Field<f64, D, M>>,
    ) -> Result<(), OutputError> {
        self.for_each(fields.into_iter().enumerate(), &|(i, field)| {
            self.array(numbered(kind, first + i, "npy"), field)
        })
    }

    /// Writes the deformed positions of displacements as [`Self::arrays`].
    pub(crate) fn deformations<const D: usize>(
        &self,
        kind: &str,
        first: usize,
        displacements: &[Field<f64, D, D>],
    ) -> Result<(), OutputError> {
        self.for_each(displacements.iter().enumerate(), &|(i, displacement)| {
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
        self.mask(name, &mask, &field.grid().nodes_per_axis())
    }

    /// Writes a mask, `size` along each axis with `x` first.
    pub(crate) fn mask(
        &self,
        name: impl AsRef<Path>,
        mask: &[bool],
        size: &[usize],
    ) -> Result<(), OutputError> {
        let Some(mut kept) = self.kept() else {
            return write_mask(&self.file(name), mask, size);
        };
        let shape = size.iter().rev().copied().collect();
        kept.push(name.as_ref(), shape, KeptNumbers::Mask(mask.to_vec()));
        Ok(())
    }

    /// Writes a matrix of these numbers of rows and columns; entries that do not exist are NaN.
    pub(crate) fn matrix(
        &self,
        name: impl AsRef<Path>,
        [rows, columns]: [usize; 2],
        entry: impl Fn(usize, usize) -> Option<f64>,
    ) -> Result<(), OutputError> {
        let Some(mut kept) = self.kept() else {
            return write_matrix_array(&self.file(name), [rows, columns], entry);
        };
        let at = |at: usize| entry(at / columns, at % columns).unwrap_or(f64::NAN);
        let numbers = KeptNumbers::Real((0..rows * columns).map(at).collect());
        kept.push(name.as_ref(), vec![rows, columns], numbers);
        Ok(())
    }

    /// Writes the record.
    ///
    /// # Errors
    /// Those of [`write_json`].
    pub(crate) fn record(
        &self,
        name: impl AsRef<Path>,
        record: &impl Serialize,
    ) -> Result<(), OutputError> {
        let Some(mut kept) = self.kept() else {
            return write_json(&self.file(name), record);
        };
        kept.record = json(name.as_ref(), record)?;
        Ok(())
    }
}
