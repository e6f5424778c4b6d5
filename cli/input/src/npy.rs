//! NumPy arrays (format versions 1 to 3). The header is parsed here, strictly: it is one flat
//! dictionary of three known keys, and anything else is rejected before memory is allocated.

use std::path::Path;

use super::decode::{Samples, check_count, take};
use super::number::NumberType;
use super::values::{Numbers, Values};
use super::{InputError, reserve};

const MAX_HEADER: usize = 1 << 16;

struct Header {
    numbers: NumberType,
    little_endian: bool,
    fortran_order: bool,
    shape: Vec<u64>,
}

/// Reads an array.
pub(crate) fn decode(bytes: &[u8], path: &Path) -> Result<Samples, InputError> {
    let (header, data) = split(bytes)
        .and_then(|(text, data)| Some((parse_header(text)?, data)))
        .ok_or_else(|| InputError::Malformed {
            path: path.into(),
            format: "NumPy array",
            reason: unreadable_reason(bytes),
        })?;
    let size: Vec<u64> = header.shape.iter().rev().copied().collect();
    // A field of vectors in space has four; the number of axes of a mask is checked for every format.
    if !(1..=4).contains(&size.len()) {
        return Err(InputError::Axes {
            path: path.into(),
            found: size.len(),
        });
    }
    let count = check_count(&size, path)?;
    let data = take(data, count * header.numbers.width(), path)?;
    // Another order of axes is a second array.
    let arrays = 1 + u64::from(header.fortran_order);
    let kept = data.len() as u64;
    // A byte more for a mask of them.
    reserve(path, arrays * kept + count as u64, kept)?;
    let size: Vec<usize> = size.into_iter().map(|n| n as usize).collect();
    let mut values = header.numbers.decode(data, header.little_endian);
    if header.fortran_order {
        values = reverse_axes(&values, &size);
    }
    Ok(Samples {
        spacing: vec![1.0; size.len()],
        values: Values::new(values),
        size,
        meaning: header.numbers.meaning(),
        affine: None,
        plain_array: true,
    })
}

/// Header text and data.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let rest = bytes.strip_prefix(b"\x93NUMPY")?;
    let (version, rest) = rest.split_at_checked(2)?;
    let (length, rest) = match version[0] {
        1 => {
            let (raw, rest) = rest.split_at_checked(2)?;
            (usize::from(u16::from_le_bytes([raw[0], raw[1]])), rest)
        }
        2 | 3 => {
            let (raw, rest) = rest.split_at_checked(4)?;
            let length = u32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]]);
            (length as usize, rest)
        }
        _ => return None,
    };
    if length > MAX_HEADER {
        return None;
    }
    let (text, data) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(text).ok()?, data))
}

fn unreadable_reason(bytes: &[u8]) -> String {
    match split(bytes) {
        None if !bytes.starts_with(b"\x93NUMPY") => "it does not start as one".into(),
        None => "its header is damaged or cut off".into(),
        Some((text, _)) => format!(
            "its header is not that of a plain array of booleans, integers, float32 or float64: {}",
            text.trim().chars().take(120).collect::<String>()
        ),
    }
}

/// Parses `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }`.
fn parse_header(text: &str) -> Option<Header> {
    let mut rest = text.trim().strip_prefix('{')?.trim_start();
    let (mut numbers, mut fortran_order, mut shape) = (None, None, None);
    while !rest.starts_with('}') {
        let (key, after) = quoted(rest)?;
        let value = after.trim_start().strip_prefix(':')?.trim_start();
        rest = match key {
            "descr" => {
                let (code, after) = quoted(value)?;
                numbers = Some(number_type(code)?);
                after
            }
            "fortran_order" => {
                let (flag, after) = match value.strip_prefix("True") {
                    Some(after) => (true, after),
                    None => (false, value.strip_prefix("False")?),
                };
                fortran_order = Some(flag);
                after
            }
            "shape" => {
                let (inside, after) = value.strip_prefix('(')?.split_once(')')?;
                shape = Some(integers(inside)?);
                after
            }
            _ => return None,
        }
        .trim_start();
        rest = match rest.strip_prefix(',') {
            Some(after) => after.trim_start(),
            None if rest.starts_with('}') => rest,
            None => return None,
        };
    }
    let (numbers, little_endian) = numbers?;
    Some(Header {
        numbers,
        little_endian,
        fortran_order: fortran_order?,
        shape: shape?,
    })
}

fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split_once(quote)
}

fn integers(text: &str) -> Option<Vec<u64>> {
    let text = text.trim();
    let text = text.strip_suffix(',').unwrap_or(text);
    if text.is_empty() {
        return Some(Vec::new());
    }
    text.split(',').map(|n| n.trim().parse().ok()).collect()
}

fn number_type(code: &str) -> Option<(NumberType, bool)> {
    let little_endian = match code.chars().next()? {
        '<' | '|' => true,
        '>' => false,
        '=' => cfg!(target_endian = "little"),
        _ => return None,
    };
    let numbers = match &code[1..] {
        "b1" => NumberType::Bool,
        "u1" => NumberType::U8,
        "i1" => NumberType::I8,
        "u2" => NumberType::U16,
        "i2" => NumberType::I16,
        "u4" => NumberType::U32,
        "i4" => NumberType::I32,
        "u8" => NumberType::U64,
        "i8" => NumberType::I64,
        "f4" => NumberType::F32,
        "f8" => NumberType::F64,
        _ => return None,
    };
    Some((numbers, little_endian))
}

/// Numbers stored with the first array axis (our last) fastest, put `x` fastest. `size` is `x`
/// first.
fn reverse_axes(values: &Numbers, size: &[usize]) -> Numbers {
    let d = size.len();
    let mut strides = vec![1; d];
    for k in (0..d - 1).rev() {
        strides[k] = strides[k + 1] * size[k + 1];
    }
    values.permuted(|mut index| {
        let mut from = 0;
        for k in 0..d {
            from += index % size[k] * strides[k];
            index /= size[k];
        }
        from
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file as NumPy writes it, with a header of 118 bytes.
    fn written<const W: usize>(
        code: &str,
        fortran: &str,
        shape: &str,
        data: &[[u8; W]],
    ) -> Vec<u8> {
        let header =
            format!("{{'descr': '{code}', 'fortran_order': {fortran}, 'shape': {shape}, }}");
        let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        bytes.extend(format!("{header:<117}\n").as_bytes());
        bytes.extend(data.as_flattened());
        bytes
    }

    #[test]
    fn another_writer_is_understood_in_both_orders() {
        let path = Path::new("a.npy");
        let data = [0.0f64, 1.0, 2.0, 3.0, 4.0, 5.0].map(f64::to_le_bytes);
        let c = written("<f8", "False", "(2, 3)", &data);
        let data = [0.0f32, 3.0, 1.0, 4.0, 2.0, 5.0].map(f32::to_le_bytes);
        let f = written("<f4", "True", "(2, 3)", &data);
        for bytes in [c, f] {
            let samples = decode(&bytes, path).unwrap();
            assert_eq!(samples.size, [3, 2]);
            assert_eq!(samples.values, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        }
        let volume: [i32; 24] = std::array::from_fn(|i| i as i32);
        let data = volume.map(i32::to_le_bytes);
        let c = decode(&written("<i4", "False", "(2, 3, 4)", &data), path).unwrap();
        let transposed = volume.map(|i| {
            let (z, y, x) = (i % 2, i / 2 % 3, i / 6);
            i32::to_le_bytes(z * 12 + y * 4 + x)
        });
        let f = decode(&written("<i4", "True", "(2, 3, 4)", &transposed), path).unwrap();
        assert_eq!(c.size, [4, 3, 2]);
        assert_eq!(c.values, f.values);
    }

    #[test]
    fn absurd_headers_are_refused() {
        let header = |text: &str| {
            let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
            bytes.extend((text.len() as u16).to_le_bytes());
            bytes.extend(text.as_bytes());
            decode(&bytes, Path::new("a.npy")).err().unwrap()
        };
        let huge = header(
            "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999, 99999999999), }",
        );
        assert!(matches!(huge, InputError::TooLarge { .. }));
        let cut = header("{'descr': '<f8', 'fortran_order': False, 'shape': (1000, 1000), }");
        assert!(matches!(
            cut,
            InputError::Truncated {
                expected: 8_000_000,
                found: 0,
                ..
            }
        ));
        let objects = header("{'descr': '|O', 'fortran_order': False, 'shape': (3, 3), }");
        assert!(matches!(objects, InputError::Malformed { .. }));
        let nested = header(&"(".repeat(9000));
        assert!(matches!(nested, InputError::Malformed { .. }));
    }
}
