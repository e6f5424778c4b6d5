//! Results.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use shapespace::api;

use crate::arrays::numpy;
use crate::report::exception;

/// The result of a command.
#[pyclass(frozen, module = "shapespace._shapespace")]
pub struct Computed(Mutex<api::Computed>);

/// The results of experiments.
#[pyclass(frozen, module = "shapespace._shapespace")]
pub struct Verified(Mutex<api::Verified>);

impl Computed {
    pub fn new(computed: api::Computed) -> Self {
        Self(Mutex::new(computed))
    }

    fn inner(&self) -> MutexGuard<'_, api::Computed> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Computed {
    /// The arrays by name; they are handed over, and a second call returns none.
    fn take_arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let arrays = self.inner().take_arrays();
        let named = PyDict::new(py);
        for array in arrays {
            let name = array.name.clone();
            named.set_item(name, numpy(py, array)?)?;
        }
        Ok(named)
    }

    /// The record as JSON.
    fn record(&self) -> String {
        self.inner().record().to_string()
    }

    /// The summary as text.
    fn summary(&self) -> String {
        self.inner().summary().to_owned()
    }

    /// Writes the result directory, or only what later commands read of it.
    fn save(&self, py: Python<'_>, folder: PathBuf, drawn: bool) -> PyResult<PathBuf> {
        py.detach(move || self.inner().save(&folder, drawn))
            .map_err(|error| exception(py, &error))
    }
}

impl Verified {
    pub fn new(verified: api::Verified) -> Self {
        Self(Mutex::new(verified))
    }

    fn inner(&self) -> MutexGuard<'_, api::Verified> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Verified {
    /// The record as JSON.
    fn record(&self) -> String {
        self.inner().record().to_string()
    }

    /// The table as text.
    fn table(&self) -> String {
        self.inner().table()
    }

    /// Whether every statement holds, or is refuted where it should be.
    fn is_well(&self) -> bool {
        self.inner().is_well()
    }

    /// Writes the result directory.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<PathBuf> {
        py.detach(move || self.inner().save(&folder))
            .map_err(|error| exception(py, &error))
    }
}
