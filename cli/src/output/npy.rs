//! NumPy arrays: C order, the last axis is `x`, components come first.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use fe_grid::{Element, Field};

use super::OutputError;

/// Bytes before the text of the header: magic number, version, length of the text.
const PREAMBLE: usize = 10;

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
        shape.push(M);
    }
    shape.extend(field.grid().nodes_per_axis().iter().rev());
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
    let shape: Vec<usize> = size.iter().rev().copied().collect();
    write_array(path, &shape, mask.iter().map(|&b| u8::from(b)))
}

/// Writes samples, `size` along each axis with `x` first: as bytes where they are such, else in single
/// precision.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_samples(path: &Path, size: &[usize], values: &[f32]) -> Result<(), OutputError> {
    let shape: Vec<usize> = size.iter().rev().copied().collect();
    if values.iter().all(|&value| f32::from(value as u8) == value) {
        write_array(path, &shape, values.iter().map(|&value| value as u8))
    } else {
        write_array(path, &shape, values.iter().copied())
    }
}

/// A type of numbers in an array.
pub(super) trait Number {
    /// Its name in the header: byte order, kind and width.
    const CODE: &str;

    /// Writes one number.
    fn write_to(self, writer: &mut impl Write) -> io::Result<()>;
}

macro_rules! number {
    ($type:ty, $code:literal) => {
        impl Number for $type {
            const CODE: &str = $code;

            fn write_to(self, writer: &mut impl Write) -> io::Result<()> {
                writer.write_all(&self.to_le_bytes())
            }
        }
    };
}

number!(u8, "|u1");
number!(f32, "<f4");
number!(f64, "<f8");

/// Writes numbers as an array of this shape.
pub(super) fn write_array<T: Number>(
    path: &Path,
    shape: &[usize],
    values: impl Iterator<Item = T>,
) -> Result<(), OutputError> {
    let file = File::create(path).map_err(OutputError::at(path))?;
    let mut writer = BufWriter::new(file);
    array_to(&mut writer, shape, values)
        .and_then(|()| writer.flush())
        .map_err(OutputError::at(path))
}

/// Version 1.0 of the format; the numbers begin at a multiple of 64 bytes.
fn array_to<T: Number>(
    mut writer: impl Write,
    shape: &[usize],
    values: impl Iterator<Item = T>,
) -> io::Result<()> {
    let sides: Vec<String> = shape.iter().map(usize::to_string).collect();
    let mut sides = sides.join(", ");
    if shape.len() == 1 {
        sides.push(',');
    }
    let code = T::CODE;
    let text = format!("{{'descr': '{code}', 'fortran_order': False, 'shape': ({sides}), }}");
    let width = (PREAMBLE + text.len() + 1).next_multiple_of(64) - PREAMBLE - 1;
    writer.write_all(b"\x93NUMPY\x01\x00")?;
    writer.write_all(&(width as u16 + 1).to_le_bytes())?;
    writeln!(writer, "{text:<width$}")?;
    for value in values {
        value.write_to(&mut writer)?;
    }
    Ok(())
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
        let (header, numbers) = bytes.split_at(128);
        // As NumPy writes it.
        let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2, 3, 4), }";
        assert_eq!(header[..10], *b"\x93NUMPY\x01\x00\x76\x00");
        assert_eq!(header[10..], *format!("{text:<117}\n").as_bytes());
        let read: Vec<f64> = numbers
            .as_chunks()
            .0
            .iter()
            .map(|&b| f64::from_le_bytes(b))
            .collect();
        assert_eq!(read, field.as_slice());

        let scalar = ScalarField::<f32, 3>::from_fn(grid, |x| [x[0] + x[2]]);
        let mut bytes = Vec::new();
        field_to(&mut bytes, &scalar, Precision::Single).unwrap();
        let (header, numbers) = bytes.split_at(128);
        let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4), }";
        assert_eq!(header[10..], *format!("{text:<117}\n").as_bytes());
        let read: Vec<f32> = numbers
            .as_chunks()
            .0
            .iter()
            .map(|&b| f32::from_le_bytes(b))
            .collect();
        assert_eq!(read, scalar.as_slice());
    }

    #[test]
    fn an_array_of_one_axis_is_written_as_a_tuple() {
        let mut bytes = Vec::new();
        array_to(&mut bytes, &[3], [1u8, 2, 3].into_iter()).unwrap();
        let text = String::from_utf8_lossy(&bytes[10..128]);
        assert!(text.starts_with("{'descr': '|u1', 'fortran_order': False, 'shape': (3,), }"));
        assert_eq!(bytes[128..], [1, 2, 3]);
    }

    #[test]
    fn a_written_field_is_read_as_the_same_image() {
        use shapespace_input::{AnyImage, ReadOptions, read_image};
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
                        .all(|(v, b)| (v == 1.0) == *b)
                );
            }
            AnyImage::D3(_) => panic!("a picture was written"),
        }
    }
}
