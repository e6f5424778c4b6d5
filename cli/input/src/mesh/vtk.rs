//! VTK legacy files of polygons (`DATASET POLYDATA`), text and binary, up to version 5.1.

use super::polygon::Polygons;
use super::text::{index, parsed, text};
use super::{Decoded, states_left};
use crate::number::NumberType;

struct Reader<'a> {
    rest: &'a [u8],
    binary: bool,
}

impl<'a> Reader<'a> {
    /// The rest of the line.
    fn line(&mut self) -> &'a [u8] {
        let end = self.rest.iter().position(|&b| b == b'\n');
        let (line, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest.get(1..).unwrap_or_default();
        line
    }

    fn word(&mut self) -> Option<String> {
        self.rest = self.rest.trim_ascii_start();
        let end = self.rest.iter().position(u8::is_ascii_whitespace);
        let (word, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest;
        (!word.is_empty()).then(|| text(word).into_owned())
    }

    fn needed_word(&mut self) -> Result<String, String> {
        self.word().ok_or_else(|| "it is cut off".into())
    }

    fn count(&mut self) -> Result<usize, String> {
        let word = self.needed_word()?;
        let stated = word.parse::<usize>();
        stated.map_err(|_| format!("'{word}' is not a count"))
    }

    /// As many numbers of a type; the line that states them ends before.
    fn numbers(&mut self, count: usize, kind: &str) -> Result<Vec<f64>, String> {
        let kind = number_type(kind)?;
        if self.binary {
            self.line();
            let length = count.checked_mul(kind.width());
            let split = length.and_then(|length| self.rest.split_at_checked(length));
            let (data, rest) = split.ok_or_else(|| self.too_short(count))?;
            self.rest = rest;
            return Ok(kind.doubles(data, false));
        }
        if count > self.rest.len() {
            return Err(self.too_short(count));
        }
        (0..count).map(|_| parsed(&self.needed_word()?)).collect()
    }

    fn too_short(&self, count: usize) -> String {
        let left = self.rest.len();
        format!("it is cut off: {count} numbers are stated where {left} bytes are left")
    }

    /// Lists of corners, in either form.
    fn cells(&mut self, mut each: impl FnMut(&[u32])) -> Result<(), String> {
        let (first, second) = (self.count()?, self.count()?);
        let before = self.rest;
        // Version 5 has where the lists end, and then all corners.
        if self.word().as_deref() == Some("OFFSETS") {
            let kind = self.needed_word()?;
            let offsets = self.numbers(first, &kind)?;
            if self.word().as_deref() != Some("CONNECTIVITY") {
                return Err("its polygons have no CONNECTIVITY".into());
            }
            let kind = self.needed_word()?;
            let corners = indices(&self.numbers(second, &kind)?)?;
            let offsets = indices(&offsets)?;
            for pair in offsets.windows(2) {
                let list = corners.get(pair[0] as usize..pair[1] as usize);
                each(list.ok_or("its polygons do not end where they state")?);
            }
            return Ok(());
        }
        self.rest = before;
        let all = indices(&self.numbers(second, "int")?)?;
        let mut rest = &all[..];
        for _ in 0..first {
            let list = rest
                .split_first()
                .and_then(|(&n, after)| after.split_at_checked(n as usize));
            let (list, after) = list.ok_or("its polygons do not end where they state")?;
            rest = after;
            each(list);
        }
        Ok(())
    }

    /// Leaves out arrays of the whole data set.
    fn skip_fields(&mut self) -> Result<(), String> {
        self.needed_word()?;
        for _ in 0..self.count()? {
            self.needed_word()?;
            let (components, tuples) = (self.count()?, self.count()?);
            let count = components
                .checked_mul(tuples)
                .ok_or("it states too many values")?;
            let kind = self.needed_word()?;
            self.numbers(count, &kind)?;
        }
        Ok(())
    }
}

pub(super) fn decode(bytes: &[u8]) -> Decoded {
    let mut reader = Reader {
        rest: bytes,
        binary: false,
    };
    if !reader.line().starts_with(b"# vtk DataFile") {
        return Err("it does not start as one".into());
    }
    let to_the_left = states_left(reader.line());
    reader.binary = match reader.line().trim_ascii() {
        b"ASCII" => false,
        b"BINARY" => true,
        _ => return Err("it is neither ASCII nor BINARY".into()),
    };
    let words = [reader.word(), reader.word()].map(Option::unwrap_or_default);
    if words != ["DATASET", "POLYDATA"] {
        return Err(format!(
            "its data are {} {}, not polygons",
            words[0], words[1]
        ));
    }
    let mut polygons = Polygons::default();
    while let Some(section) = reader.word() {
        match section.as_str() {
            "POINTS" => {
                let count = reader.count()?;
                let kind = reader.needed_word()?;
                let count = count.checked_mul(3).ok_or("it states too many points")?;
                let numbers = reader.numbers(count, &kind)?;
                polygons.points = numbers.as_chunks::<3>().0.to_vec();
            }
            "POLYGONS" => reader.cells(|corners| polygons.polygon(corners))?,
            "TRIANGLE_STRIPS" => reader.cells(|corners| polygons.strip(corners))?,
            "VERTICES" | "LINES" => reader.cells(|_| {})?,
            "METADATA" => {
                reader.line();
                while !reader.line().trim_ascii().is_empty() {}
            }
            "FIELD" => reader.skip_fields()?,
            "POINT_DATA" | "CELL_DATA" => break,
            other => {
                let shown: String = other.chars().take(20).collect();
                return Err(format!("it has the unknown section '{shown}'"));
            }
        }
    }
    Ok((polygons, to_the_left))
}

fn indices(numbers: &[f64]) -> Result<Vec<u32>, String> {
    numbers.iter().map(|&number| index(number)).collect()
}

fn number_type(name: &str) -> Result<NumberType, String> {
    Ok(match name {
        "unsigned_char" => NumberType::U8,
        "char" => NumberType::I8,
        "unsigned_short" => NumberType::U16,
        "short" => NumberType::I16,
        "unsigned_int" => NumberType::U32,
        "int" => NumberType::I32,
        "unsigned_long" | "vtktypeuint64" => NumberType::U64,
        "long" | "vtkIdType" | "vtktypeint64" => NumberType::I64,
        "float" => NumberType::F32,
        "double" => NumberType::F64,
        _ => {
            let shown: String = name.chars().take(20).collect();
            return Err(format!("it has numbers of the unknown type '{shown}'"));
        }
    })
}
