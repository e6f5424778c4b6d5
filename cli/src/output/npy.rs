//! NumPy arrays: C order, the last axis is `x`, components come first.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use fe_grid::{Element, Field};
use npyz::WriterBuilder;

use super::OutputError;

/// Precision of the numbers in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Four bytes a number.
    Single,
    /// Eight bytes a number.
    Double,
}

/// Writes a scalar field as `([nz,] ny, nx)`, a field of several components as
/// `(components, [nz,] ny, nx)`.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_field<T: Element, const D: usize, const M: usize>(
    path: &Path,
    field: &Field<T, D, M>,
    precision: Precision,
) -> Result<(), OutputError> {
    let file = File::create(path).map_err(OutputError::at(path))?;
    let mut writer = BufWriter::new(file);
    field_to(&mut writer, field, precision)
        .and_then(|()| writer.flush())
        .map_err(OutputError::at(path))
}

/// The same into any writer.
///
/// # Errors
/// Those of the writer.
pub fn field_to<T: Element, const D: usize, const M: usize>(
    writer: impl Write,
    field: &Field<T, D, M>,
    precision: Precision,
) -> io::Result<()> {
    let mut shape = Vec::with_capacity(D + 1);
    if M > 1 {
        shape.push(M as u64);
    }
    shape.extend(
        field
            .grid()
            .nodes_per_axis()
            .iter()
            .rev()
            .map(|&n| n as u64),
    );
    let values = field.as_slice().iter().map(|value| value.to_f64());
    match precision {
        Precision::Single => array_to(writer, &shape, values.map(|value| value as f32)),
        Precision::Double => array_to(writer, &shape, values),
    }
}

/// Writes a mask as bytes 0 and 1, `size` along each axis with `x` first.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_mask(path: &Path, mask: &[bool], size: &[usize]) -> Result<(), OutputError> {
    let shape: Vec<u64> = size.iter().rev().map(|&n| n as u64).collect();
    write_array(path, &shape, mask.iter().map(|&b| u8::from(b)))
}

/// Writes numbers as an array of this shape.
pub(super) fn write_array<T: npyz::AutoSerialize>(
    path: &Path,
    shape: &[u64],
    values: impl Iterator<Item = T>,
) -> Result<(), OutputError> {
    let file = File::create(path).map_err(OutputError::at(path))?;
    let mut writer = BufWriter::new(file);
    array_to(&mut writer, shape, values)
        .and_then(|()| writer.flush())
        .map_err(OutputError::at(path))
}

fn array_to<T: npyz::AutoSerialize>(
    writer: impl Write,
    shape: &[u64],
    values: impl Iterator<Item = T>,
) -> io::Result<()> {
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(shape)
        .writer(writer)
        .begin_nd()?;
    writer.extend(values)?;
    writer.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::{Grid, ScalarField, VectorField};

    #[test]
    fn fields_come_back_with_their_axes() {
        let grid = Grid::<3>::with_nodes([4, 3, 2], 0.25).unwrap();
        let field = VectorField::<f64, 3>::from_fn(grid, |x| [x[0], 10.0 * x[1], 100.0 * x[2]]);
        let mut bytes = Vec::new();
        field_to(&mut bytes, &field, Precision::Double).unwrap();
        let read = npyz::NpyFile::new(&bytes[..]).unwrap();
        assert_eq!(read.shape(), [3, 2, 3, 4]);
        assert_eq!(read.into_vec::<f64>().unwrap(), field.as_slice());

        let scalar = ScalarField::<f32, 3>::from_fn(grid, |x| [x[0] + x[2]]);
        let mut bytes = Vec::new();
        field_to(&mut bytes, &scalar, Precision::Single).unwrap();
        let read = npyz::NpyFile::new(&bytes[..]).unwrap();
        assert_eq!(read.shape(), [2, 3, 4]);
        assert_eq!(read.into_vec::<f32>().unwrap(), scalar.as_slice());
    }

    #[test]
    fn a_written_field_is_read_as_the_same_image() {
        use crate::input::{AnyImage, ReadOptions, read_image};
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("f.npy");
        let field = ScalarField::<f64, 2>::from_fn(Grid::cube(5), |x| [x[0] * x[1]]);
        write_field(&path, &field, Precision::Double).unwrap();
        match read_image(&path, &ReadOptions::default()).unwrap() {
            AnyImage::D2(image) => assert_eq!(image.values, field.as_slice()),
            AnyImage::D3(_) => panic!("a picture was written"),
        }
        let mask: Vec<bool> = field.as_slice().iter().map(|&v| v >= 0.5).collect();
        let path = place.path().join("m.npy");
        write_mask(&path, &mask, &[5, 5]).unwrap();
        match read_image(&path, &ReadOptions::default()).unwrap() {
            AnyImage::D2(image) => {
                assert!(
                    image
                        .values
                        .iter()
                        .zip(&mask)
                        .all(|(v, b)| (*v == 1.0) == *b)
                );
            }
            AnyImage::D3(_) => panic!("a picture was written"),
        }
    }
}
