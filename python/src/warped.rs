//! Volumes and points, carried through the deformation of an input of an average.

use std::path::{Path, PathBuf};

use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use shapespace::api::{Interpolation, Warp};

use crate::arrays::{Given, sources};
use crate::report::exception;

/// Where points of the world go.
#[pyfunction]
#[pyo3(signature = (average, points, *, shape, inverse, trust))]
#[expect(clippy::needless_pass_by_value, reason = "arguments of Python")]
pub fn warp_points(
    py: Python<'_>,
    average: PathBuf,
    points: Vec<[f64; 3]>,
    shape: usize,
    inverse: bool,
    trust: bool,
) -> PyResult<Vec<[f64; 3]>> {
    py.detach(|| {
        let warp = Warp::read(&average, shape, inverse, trust)?;
        Ok(warp.points(&points))
    })
    .map_err(|error| exception(py, &error))
}

/// A volume at the samples of the average, or of the input: its values with `x` last, and its affine
/// map with `x` first.
#[pyfunction]
#[pyo3(signature = (average, name, arrays, *, shape, inverse, trust, interpolation, threads))]
#[expect(clippy::needless_pass_by_value, reason = "arguments of Python")]
pub fn warp_volume<'py>(
    py: Python<'py>,
    average: PathBuf,
    name: String,
    arrays: Vec<Given<'py>>,
    shape: usize,
    inverse: bool,
    trust: bool,
    interpolation: Option<&str>,
    threads: Option<u32>,
) -> PyResult<(Bound<'py, PyAny>, [[f64; 4]; 3])> {
    let interpolation = match interpolation {
        None => None,
        Some("linear") => Some(Interpolation::Linear),
        Some("nearest") => Some(Interpolation::Nearest),
        Some(other) => {
            let text = format!("interpolation is 'linear' or 'nearest', not '{other}'");
            return Err(PyValueError::new_err(text));
        }
    };
    let sources = sources(py, arrays)?;
    let carried = py.detach(|| {
        let warp = Warp::read(&average, shape, inverse, trust)?;
        warp.volume(&sources, Path::new(&name), interpolation, threads)
    });
    let carried = carried.map_err(|error| exception(py, &error))?;
    let [nx, ny, nz] = carried.size;
    let values = PyArray1::from_vec(py, carried.values).reshape([nz, ny, nx])?;
    Ok((values.into_any(), carried.affine))
}
