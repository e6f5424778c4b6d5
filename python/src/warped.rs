//! Images and points, carried through the deformations of a result.

use std::path::{Path, PathBuf};

use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use shapespace::api::{Interpolation, Warp, Way};

use crate::arrays::{Given, sources};
use crate::report::exception;

/// Between which shapes: `shape`, `to_shape`, `time`, `from_time` and `scores`, as for `shapespace warp`.
type Shapes = (
    Option<usize>,
    Option<usize>,
    Option<f64>,
    Option<f64>,
    Vec<f64>,
);

fn way((shape, to_shape, time, from_time, scores): Shapes) -> Way {
    Way {
        shape,
        to_shape,
        time,
        from_time,
        scores,
    }
}

/// Where points go. They have as many coordinates as the shapes have dimensions.
#[pyfunction]
#[pyo3(signature = (result, points, *, shapes, inverse, trust))]
#[expect(clippy::needless_pass_by_value, reason = "arguments of Python")]
pub fn warp_points(
    py: Python<'_>,
    result: PathBuf,
    points: Vec<Vec<f64>>,
    shapes: Shapes,
    inverse: bool,
    trust: bool,
) -> PyResult<Vec<Vec<f64>>> {
    let warp = py.detach(|| Warp::read(&result, &way(shapes), (inverse, 1), trust));
    let warp = warp.map_err(|error| exception(py, &error))?;
    let dimension = warp.dimension();
    if points.iter().any(|point| point.len() != dimension) {
        let text = format!("points of this result have {dimension} coordinates each");
        return Err(PyValueError::new_err(text));
    }
    let points: Vec<[f64; 3]> = points
        .iter()
        .map(|point| std::array::from_fn(|k| point.get(k).copied().unwrap_or(0.0)))
        .collect();
    let found = py.detach(|| warp.points(&points));
    let rows = found.iter().map(|point| point[..dimension].to_vec());
    Ok(rows.collect())
}

/// An image at the samples of another shape: its values with `x` last, and its affine map with `x` first.
#[pyfunction]
#[pyo3(signature = (result, name, arrays, *, shapes, inverse, refine, trust, interpolation, threads))]
#[expect(clippy::needless_pass_by_value, reason = "arguments of Python")]
pub fn warp_image<'py>(
    py: Python<'py>,
    result: PathBuf,
    name: String,
    arrays: Vec<Given<'py>>,
    shapes: Shapes,
    inverse: bool,
    refine: usize,
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
        let warp = Warp::read(&result, &way(shapes), (inverse, refine), trust)?;
        let image = warp.image(&sources, Path::new(&name), interpolation, threads)?;
        Ok((warp.dimension(), image))
    });
    let (dimension, carried) = carried.map_err(|error| exception(py, &error))?;
    let [nx, ny, nz] = carried.size;
    let values = PyArray1::from_vec(py, carried.values);
    let values = if dimension == 2 {
        values.reshape([ny, nx])?.into_any()
    } else {
        values.reshape([nz, ny, nx])?.into_any()
    };
    Ok((values, carried.affine))
}
