//! NumPy arrays in and out.

use std::path::Path;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use shapespace::api::{ArrayType, KeptArray, KeptNumbers, NamedArray, Sources, check_count};

use crate::report::exception;

/// An array with its name, its spacing and its affine map, both `x` first. Its last axis is `x`.
pub type Given<'py> = (
    String,
    Bound<'py, PyAny>,
    Option<Vec<f64>>,
    Option<[[f64; 4]; 3]>,
);

/// The numbers in double precision, for every type that an array may have.
fn numbers(array: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, ArrayType, Vec<usize>)> {
    macro_rules! of_type {
        ($($type:ty => $meaning:ident by $convert:expr),*) => {$(
            if let Ok(found) = array.extract::<PyReadonlyArrayDyn<'_, $type>>() {
                let values = found.as_array().iter().copied().map($convert).collect();
                return Ok((values, ArrayType::$meaning, found.shape().to_vec()));
            }
        )*};
    }
    of_type!(
        bool => Bool by |v| f64::from(u8::from(v)),
        u8 => U8 by f64::from,
        f64 => Real by |v| v,
        f32 => Real by f64::from,
        u16 => U16 by f64::from,
        i8 => Integer by f64::from,
        i16 => Integer by f64::from,
        i32 => Integer by f64::from,
        u32 => Integer by f64::from,
        i64 => Integer by |v| v as f64,
        u64 => Integer by |v| v as f64
    );
    let kind: String = array.getattr("dtype")?.str()?.extract()?;
    Err(PyTypeError::new_err(format!(
        "an array of {kind} is no image: give booleans, integers, float32 or float64"
    )))
}

/// Refuses an array with more values than an input may have: a copy of it might end the interpreter.
#[pyfunction]
pub fn check_size(py: Python<'_>, name: &str, shape: Vec<u64>) -> PyResult<()> {
    let size: Vec<u64> = shape.into_iter().rev().collect();
    match check_count(&size, Path::new(name)) {
        Ok(_) => Ok(()),
        Err(error) => Err(exception(py, &error.into())),
    }
}

/// Adds arrays to the inputs of a call.
pub fn sources(py: Python<'_>, given: Vec<Given<'_>>) -> PyResult<Sources> {
    let mut sources = Sources::files();
    for (name, array, spacing, affine) in given {
        let (values, numbers, mut size) = numbers(&array)?;
        size.reverse();
        let array = NamedArray {
            values,
            numbers,
            size,
            spacing,
            affine,
        };
        let added = sources.insert(Path::new(&name), array);
        added.map_err(|error| exception(py, &error.into()))?;
    }
    Ok(sources)
}

/// A NumPy array that owns the numbers of a result; they are not copied.
pub fn numpy(py: Python<'_>, array: KeptArray) -> PyResult<Bound<'_, PyAny>> {
    let shape = array.shape;
    Ok(match array.numbers {
        KeptNumbers::Real(values) => PyArray1::from_vec(py, values).reshape(shape)?.into_any(),
        KeptNumbers::Mask(values) => PyArray1::from_vec(py, values).reshape(shape)?.into_any(),
    })
}
